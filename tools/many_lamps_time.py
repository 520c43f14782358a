#!/usr/bin/env python3
"""Time for an error under many lamps over that under one, on vector units.

    python3 tools/many_lamps_time.py target/release/uw [--spp 64] [--lamps 1,4,9,25,100,225]

A bottom in 3C, 96 x 54 pixels, under a square grid of lamps 1.2 m above 6 m x 6 m of it, which share the same light; one thread. What
is compared is the square of the relative error times the time of the render.
"""

import argparse
import json
import math
import pathlib
import subprocess
import tempfile

SCENE = """format = "uw-scene/1"
[water]
jerlov = "3C"
phase = { model = "fournier-forand", n = 1.10, backscatter_fraction = 0.0183 }
[camera]
position_m = [0.0, 0.0, 2.0]
forward = [1.0, 0.0, -0.8]
up = [0.0, 0.0, 1.0]
hfov_deg = 70.0
width = 96
height = 54
[[object]]
plane = { center_m = [5.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0], up = [1.0, 0.0, 0.0], size_m = [40.0, 40.0] }
reflectance = [0.3, 0.3, 0.3]
"""
LAMP = """[[lamp]]
name = "{name}"
position_m = [{x}, {y}, 1.2]
forward = [0.0, 0.0, -1.0]
intensity = [{power}, {power}, {power}]
half_angle_deg = 70.0
falloff = "cosine"
radius_m = 0.03
"""


def scene(lamps):
    side = math.isqrt(lamps)
    if side * side != lamps:
        raise SystemExit(f"--lamps must be squares of whole numbers, got {lamps}")
    places = [(0.5 + 6 * (i + 0.5) / side, -3 + 6 * (j + 0.5) / side) for i in range(side) for j in range(side)]
    return SCENE + "".join(
        LAMP.format(name=f"lamp{k}", x=x, y=y, power=30 / lamps) for k, (x, y) in enumerate(places)
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("uw")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--lamps", default="1,4,9,25,100,225")
    arguments = parser.parse_args()
    first = None
    with tempfile.TemporaryDirectory() as folder:
        file, out, stats = (pathlib.Path(folder) / name for name in ("scene.toml", "out.exr", "stats.json"))
        for lamps in map(int, arguments.lamps.split(",")):
            file.write_text(scene(lamps))
            options = ["--spp", str(arguments.spp), "--backend", "cpu-simd", "--threads", "1", "--quiet"]
            subprocess.run([arguments.uw, "render", file, "-o", out, "--stats", stats, *options], check=True)
            told = json.loads(stats.read_text())
            cost = told["relative_error"] ** 2 * told["render_s"]
            first = first or cost
            print(f"{lamps:4} lamps: error {told['relative_error']:.3f}, {told['render_s']:.2f} s, time for an error {cost / first:.2f}")


if __name__ == "__main__":
    main()
