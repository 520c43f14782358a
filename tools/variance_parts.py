#!/usr/bin/env python3
"""What the variance of a scene's pixels consists of.

    python3 tools/variance_parts.py target/release/uw assets/benchmarks/{s2_turbid,s2d_turbid_disk,s3_sun}.toml [--spp 256]

Renders each scene twice with independent numbers; half the squared difference of the two, times the samples, over the squared light of
the whole picture's pixels (as relMSE does), is printed as a table of relMSE x samples: of all light, of its layers (what came to a surface and from it without
scattering, what scattered and met a surface, what met none), with all surfaces of their mean reflectance instead of their texture, and of
light that was scattered or reflected at most 2, 3, 4, 6, 8, 16 times. Parts share numbers, so that they need not add up. Needs numpy and OpenEXR.
"""

import argparse
import subprocess
import tempfile
import tomllib
from pathlib import Path

import numpy as np
import OpenEXR

ORDERS = [2, 3, 4, 6, 8, 16]
# Share of the picture's squared mean that is added to a pixel's, as in relMSE (docs/interfaces.md).
FLOOR = 1e-4


def layers(path):
    """Total, direct and backscattered light, each an array of H x W x 3."""
    channels = OpenEXR.File(str(path), separate_channels=True).channels()
    of = lambda name: np.stack([np.asarray(channels[name + c].pixels, dtype=np.float64) for c in "RGB"], axis=-1)
    return {"all": of(""), "direct": of("direct."), "veil": of("backscatter.")}


def render(uw, scene, spp, seed, options, folder):
    out = Path(folder) / "picture.exr"
    command = [uw, "render", scene, "--quiet", "--spp", str(spp), "--seed", str(seed), "--width", "160", "--layers", "direct,backscatter"]
    subprocess.run([*command, *options, "-o", str(out)], check=True)
    found = layers(out)
    found["scattered"] = found["all"] - found["direct"] - found["veil"]
    return found


def variance(uw, scene, spp, options, level=None):
    """relMSE x samples of each layer, and the squared light it is over."""
    with tempfile.TemporaryDirectory() as folder:
        one, two = (render(uw, scene, spp, seed, options, folder) for seed in (1, 2))
    if level is None:
        mean = 0.5 * (one["all"] + two["all"])
        level = mean**2 + FLOOR * mean.mean(axis=(0, 1)) ** 2
    return {name: spp * float((0.5 * (one[name] - two[name]) ** 2 / level).mean()) for name in one}, level


def textured(scene):
    """The numbers of the objects that have a texture."""
    objects = tomllib.loads(Path(scene).read_text(encoding="utf-8")).get("object", [])
    return [i for i, thing in enumerate(objects) if isinstance(thing.get("reflectance"), dict)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("uw")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--reflectance", type=float, default=0.4, help="instead of textures")
    asked = parser.parse_args()
    print("| scene | all | unscattered | scattered, met a surface | met none | without texture |", *(f"at most {n} |" for n in ORDERS))
    print("|---" * (6 + len(ORDERS)) + "|")
    for scene in asked.scenes:
        found, level = variance(asked.uw, scene, asked.spp, [])
        plain = f"[{asked.reflectance}, {asked.reflectance}, {asked.reflectance}]"
        even = [part for i in textured(scene) for part in ("--set", f"object.{i}.reflectance={plain}")]
        row = [found[name] for name in ("all", "direct", "scattered", "veil")]
        row.append(variance(asked.uw, scene, asked.spp, even)[0]["all"])
        row += [variance(asked.uw, scene, asked.spp, ["--max-bounces", str(n)], level)[0]["all"] for n in ORDERS]
        print(f"| {Path(scene).stem} |", *(f"{value:.3g} |" for value in row), flush=True)


if __name__ == "__main__":
    main()
