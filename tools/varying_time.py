#!/usr/bin/env python3
"""Time of pictures in water that varies over that of the same picture in homogeneous water, on vector units.

    python3 tools/varying_time.py target/release/uw [--spp 16] [--runs 3]

The scenes are assets/benchmarks/s2_turbid.toml with its water replaced; times are the least of the runs, one thread each.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile

SCENE = pathlib.Path(__file__).resolve().parent.parent / "assets/benchmarks/s2_turbid.toml"
PHASE = "phase = {"
EVEN = "a = [0.45, 0.20, 0.35]\nb = [0.9, 1.0, 1.1]\n"
SURFACE = "[surface]\nheight_m = 5.0\nrefractive = false\n\n[camera]"
PROFILE = (
    "profile = [ { depth_m = 0.0, a = [0.45, 0.20, 0.35], b = [0.5, 0.6, 0.7] }, "
    "{ depth_m = 4.8, a = [0.45, 0.20, 0.35], b = [0.5, 0.6, 0.7] }, "
    "{ depth_m = 5.2, a = [0.45, 0.20, 0.35], b = [1.3, 1.4, 1.5] } ]\n"
)
THIN = (
    "profile = [ { depth_m = 5.0, a = [0.1, 0.1, 0.1], b = [0.15, 0.15, 0.15] }, "
    "{ depth_m = 5.25, a = [0.1, 0.1, 0.1], b = [4.0, 4.0, 4.0] }, "
    "{ depth_m = 5.5, a = [0.1, 0.1, 0.1], b = [0.15, 0.15, 0.15] } ]\n"
)
CLOUD = (
    "[[water.plume]]\ncenter_m = [0.8, 0.0, -0.2]\nsigma_m = 0.3\na = [0.1, 0.1, 0.1]\nb = [1.5, 1.5, 1.5]\n\n[camera]"
)


def downwards(text):
    """The same view straight down, through layers."""
    for old, new in [
        ("forward = [1.0, 0.0, 0.0]", "forward = [0.0, 0.0, -1.0]"),
        ("\nup = [0.0, 0.0, 1.0]\nhfov", "\nup = [1.0, 0.0, 0.0]\nhfov"),
        (
            "center_m = [1.5, 0.0, 0.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0]",
            "center_m = [0.0, 0.0, -1.5], normal = [0.0, 0.0, 1.0], up = [1.0, 0.0, 0.0]",
        ),
    ]:
        assert old in text, old
        text = text.replace(old, new)
    return text


def scenes():
    """Names and texts."""
    even = SCENE.read_text().replace("target_tex.png", str(SCENE.parent / "target_tex.png"))
    assert EVEN in even and PHASE in even
    profile = even.replace(EVEN, PROFILE).replace("[camera]", SURFACE)
    thin = downwards(even.replace(EVEN, THIN).replace("[camera]", SURFACE))
    return {"even": even, "profile": profile, "thin layer": thin, "cloud": even.replace("[camera]", CLOUD)}


def seconds(uw, scene, spp, folder):
    """Time of one render."""
    stats = folder / "stats.json"
    command = [uw, "render", scene, "-o", folder / "picture.exr", "--spp", str(spp), "--backend", "cpu-simd"]
    subprocess.run(command + ["--threads", "1", "--stats", stats, "--quiet"], check=True)
    return json.loads(stats.read_text())["render_s"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("uw", help="the program")
    parser.add_argument("--spp", type=int, default=16, help="samples per pixel")
    parser.add_argument("--runs", type=int, default=3, help="renders of each scene")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        times = {}
        for name, text in scenes().items():
            scene = folder / "scene.toml"
            scene.write_text(text)
            times[name] = min(seconds(options.uw, scene, options.spp, folder) for _ in range(options.runs))
            print(f"{name}: {times[name]:.2f} s, {times[name] / times['even']:.2f} x even water", flush=True)


if __name__ == "__main__":
    main()
