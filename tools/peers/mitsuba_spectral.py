"""A scene by wavelength by Mitsuba and here: mean of the picture per channel, with standard errors of independent renders.

    pip install mitsuba==3.9.1 numpy OpenEXR
    cargo build --release --bin uw
    python tools/peers/mitsuba_spectral.py --uw target/release/uw

A disk lamp with the spectrum of a white LED lights a grey wall 1.5 m away through water of a Jerlov type that scatters as
Henyey and Greenstein with a mean cosine of 0.5, where both have a finite variance. Mitsuba's `scalar_spectral` carries four
wavelengths a path; its `specfilm` sees three boxes of 100 nm. Here each sample has a wavelength for each channel.
"""

import argparse
import csv
import io
import pathlib
import subprocess
import tempfile

import mitsuba as mi
import numpy as np
import OpenEXR

mi.set_variant("scalar_spectral")

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
WALL_M, RADIUS_M, ASIDE_M, REFLECTANCE, MEAN_COSINE, HFOV_DEG = 1.5, 0.05, 0.3, 0.5, 0.5, 30.0
BOXES_NM = [(600.0, 700.0), (500.0, 600.0), (400.0, 500.0)]
SIZE = 16

SCENE = f"""format = "uw-scene/1"
water = {{ jerlov = "WATER", phase = {{ model = "henyey-greenstein", g = {MEAN_COSINE} }} }}
camera = {{ position_m = [0.0, 0.0, 0.0], forward = [1.0, 0.0, 0.0], hfov_deg = {HFOV_DEG}, width = {SIZE}, height = {SIZE} }}
[[lamp]]
position_m = [0.0, {ASIDE_M}, 0.0]
forward = [1.0, 0.0, 0.0]
intensity = [1.0, 1.0, 1.0]
radius_m = {RADIUS_M}
spectrum = "led-5000k"
[[object]]
plane = {{ center_m = [{WALL_M}, 0.0, 0.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [40.0, 40.0] }}
reflectance = [{REFLECTANCE}, {REFLECTANCE}, {REFLECTANCE}]
"""


def water(uw, jerlov):
    """Wavelengths, nm, and a and b, 1/m."""
    text = subprocess.check_output([uw, "water", "--jerlov", jerlov, "--bands", "spectral"], text=True)
    rows = list(csv.DictReader(io.StringIO(text)))
    return [np.array([float(row[name]) for row in rows]) for name in ("wavelength_nm", "a_per_m", "b_per_m")]


def led():
    """Wavelengths, nm, and relative power of CIE LED-B4, which scene files call led-5000k."""
    lines = (ROOT / "assets/spectra/lamp_spectra.csv").read_text().splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    return [np.array([float(row[name]) for row in rows]) for name in ("wavelength_nm", "LED-B4")]


def irregular(nm, values):
    listed = lambda xs: ", ".join(f"{x:.9g}" for x in xs)  # noqa: E731
    return {"type": "irregular", "wavelengths": listed(nm), "values": listed(values)}


def emission():
    """Radiance of the lamp: of each channel as bright as the others in the mean."""
    nm, power = led()
    fine = np.arange(400.0, 700.5, 1.0)
    relative = np.interp(fine, nm, power)
    parts_nm, parts = [], []
    for low, high in reversed(BOXES_NM):
        inside = (fine >= low) & (fine <= high)
        mean = np.trapezoid(relative[inside], fine[inside]) / (high - low)
        parts_nm.extend(np.clip(fine[inside], low + 1e-3, high - 1e-3))
        parts.extend(relative[inside] / mean)
    return irregular(parts_nm, np.array(parts) / (np.pi * RADIUS_M**2))


def build(nm, a, b):
    T = mi.ScalarTransform4f
    box = lambda low, high: irregular([low, low + 1e-3, high - 1e-3, high], [0.0, 1.0, 1.0, 0.0])  # noqa: E731
    in_water = {"type": "ref", "id": "water"}
    towards_wall = T().look_at(origin=[0, ASIDE_M, 0], target=[1, ASIDE_M, 0], up=[0, 0, 1])
    film = {"type": "specfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}}
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "volpathmis", "max_depth": 256, "rr_depth": 256},
            "water": {
                "type": "homogeneous",
                "id": "water",
                "sigma_t": irregular(nm, a + b),
                "albedo": irregular(nm, b / (a + b)),
                "phase": {"type": "hg", "g": MEAN_COSINE},
            },
            "sea": {"type": "sphere", "radius": 100.0, "bsdf": {"type": "null"}, "interior": in_water},
            "sensor": {
                "type": "perspective",
                "fov": HFOV_DEG,
                "fov_axis": "x",
                "to_world": T().look_at(origin=[0, 0, 0], target=[1, 0, 0], up=[0, 0, 1]),
                "medium": in_water,
                "film": film | {name: box(*edges) for name, edges in zip(("red", "green", "blue"), BOXES_NM)},
                "sampler": {"type": "independent"},
            },
            "lamp": {
                "type": "disk",
                "to_world": towards_wall @ T().scale(RADIUS_M),
                "bsdf": {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.0}},
                "emitter": {"type": "area", "radiance": emission()},
                "exterior": in_water,
            },
            "wall": {
                "type": "rectangle",
                "to_world": T().look_at(origin=[WALL_M, 0, 0], target=[0, 0, 0], up=[0, 0, 1]) @ T().scale(20.0),
                "bsdf": {"type": "diffuse", "reflectance": {"type": "uniform", "value": REFLECTANCE}},
                "exterior": in_water,
            },
        }
    )


def mean_and_error(values):
    values = np.array(values)
    return values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(len(values))


def by_mitsuba(scene, renders, spp):
    pictures = (np.array(mi.render(scene, spp=spp, seed=seed)) for seed in range(renders))
    widths_nm = np.array([high - low for low, high in BOXES_NM])
    return mean_and_error([picture.reshape(-1, 3).mean(axis=0) / widths_nm for picture in pictures])


def by_uw(uw, jerlov, renders, spp):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "scene.toml").write_text(SCENE.replace("WATER", jerlov))
        means = []
        for seed in range(renders):
            out = folder / f"{seed}.exr"
            command = [uw, "render", folder / "scene.toml", "-o", out, "--spp", str(spp), "--seed", str(seed + 1)]
            subprocess.run(command, check=True, capture_output=True)
            channels = OpenEXR.File(str(out), separate_channels=True).channels()
            means.append([float(np.mean(channels[name].pixels)) for name in "RGB"])
    return mean_and_error(means)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--uw", default="target/release/uw")
    parser.add_argument("--waters", default="II,3C")
    parser.add_argument("--renders", type=int, default=16)
    parser.add_argument("--mitsuba-spp", type=int, default=1024)
    parser.add_argument("--spp", type=int, default=64)
    args = parser.parse_args()
    print("water,channel,mitsuba,standard_error,here,standard_error,z")
    for jerlov in args.waters.split(","):
        theirs, their_error = by_mitsuba(build(*water(args.uw, jerlov)), args.renders, args.mitsuba_spp)
        ours, our_error = by_uw(args.uw, jerlov, args.renders, args.spp)
        for k, channel in enumerate("rgb"):
            z = (theirs[k] - ours[k]) / np.hypot(their_error[k], our_error[k])
            print(f"{jerlov},{channel},{theirs[k]:.5g},{their_error[k]:.2g},{ours[k]:.5g},{our_error[k]:.2g},{z:+.2f}")


if __name__ == "__main__":
    main()
