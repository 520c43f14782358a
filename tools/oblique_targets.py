#!/usr/bin/env python3
"""How far predictions by physics are off before a target that is not seen square on.

    python3 tools/oblique_targets.py DIR --jerlov 1C --angles-deg 0,30,45,60     # two minutes of processor time an angle; uw in the path

Renders a wall that turns about the vertical through the point that the camera looks at, from four distances with the lamps off and at 60 %, 3 m deep,
and predicts its contrast at each of these places from pictures at two of them. Prints a line for each angle: relative error, its mean, and the share within the
90 % intervals, for the same distance under other light, from farther away for nearer places, and from nearer for farther ones.
Pictures that are in the folder already are not rendered again.
"""

import argparse
import csv
import json
import math
import subprocess
from pathlib import Path
from typing import Dict, List, NamedTuple, Tuple

SIZE = (480, 270)
DISTANCES_M = (0.7, 1.0, 1.5, 2.2)
FROM_M = (1.0, 1.5)
LIGHTS_PCT = (0, 60)
Place = Tuple[float, int]
LAMP = """[[lamp]]
name = "{name}"
position_m = [0.0, {across}, 0.0]
forward = [1.0, 0.0, 0.0]
intensity = [0.4, 0.4, 0.4]
half_angle_deg = 50.0
falloff = "cosine"
level_pct = {light}
"""
SCENE = """format = "uw-scene/1"
[water]
jerlov = "{jerlov}"
bands = "mean"
phase = {{ model = "fournier-forand", n = 1.10, backscatter_fraction = 0.0183 }}
[surface]
height_m = 3.0
[sun]
zenith_deg = 30.0
azimuth_deg = 0.0
irradiance = [1.0, 1.0, 1.0]
[sky]
radiance = [0.1, 0.1, 0.1]
[camera]
position_m = [0.0, 0.0, 0.0]
forward = [1.0, 0.0, 0.0]
hfov_deg = 60.0
width = {width}
height = {height}
[[object]]
plane = {{ center_m = [{distance}, 0.0, 0.0], normal = [{ahead:.8f}, {across:.8f}, 0.0], up = [0.0, 0.0, 1.0], size_m = [16.0, 5.8] }}
reflectance = {{ texture = "shipped:textures/{texture}.png", tile_m = [6.0, 6.0] }}
[sensor]
exposure = 8.61
encoding = "srgb"
noise = {{ a = 2e-4, b = 1e-6 }}
"""


class Prediction(NamedTuple):
    """One channel at a place, 8-bit counts."""

    kind: str
    contrast: float
    error: float
    truth: float


def uw(folder: Path, *arguments: object) -> str:
    """Runs `uw` in the folder and returns what it prints; its warnings are not shown."""
    return subprocess.run(["uw", *map(str, arguments)], cwd=folder, check=True, capture_output=True, text=True).stdout


def measured(folder: Path, scene: Dict[str, object], angle_deg: float, place: Place) -> List[float]:
    """Contrast of the picture from a place, which is rendered where it is not there."""
    distance_m, light_pct = place
    name = f"{angle_deg:g}_{distance_m:g}_{light_pct}"
    if not (folder / f"{name}.png").exists():
        ahead, across = -math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
        text = SCENE.format(**scene, width=SIZE[0], height=SIZE[1], distance=distance_m, ahead=ahead, across=across)
        text += "".join(LAMP.format(name=lamp, across=side, light=light_pct) for lamp, side in (("left", 0.3), ("right", -0.3)))
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
        uw(folder, "render", f"{name}.toml", "-o", f"{name}.exr", "--spp", 16, "--denoise", "--quiet")
        uw(folder, "sensor", f"{name}.exr", f"{name}.toml", "-o", f"{name}.png", "--seed", 7)
    return json.loads(uw(folder, "stats", "--json", f"{name}.png"))[0]["contrast"]


def predicted(folder: Path, angle_deg: float, place: Place, truth: Dict[Place, List[float]]) -> List[Prediction]:
    """What the picture from a place predicts for all others."""
    distance_m, light_pct = place
    image = f"{angle_deg:g}_{distance_m:g}_{light_pct}.png"
    here = ("--image", image, "--distance-m", distance_m, "--light-pct", light_pct, "--depth-m", 3)
    uw(folder, "predict", "--water", "water.json", *here, "--candidates", "places.csv", "-o", "contrast.csv")
    found = []
    with (folder / "contrast.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            there = (float(row["distance_m"]), int(float(row["light_pct"])))
            kind = "same" if there[0] == distance_m else "nearer" if there[0] < distance_m else "farther"
            for k, channel in enumerate("rgb"):
                if row[f"contrast_{channel}"] and there != place:
                    found.append(Prediction(kind, float(row[f"contrast_{channel}"]), float(row[f"error_{channel}"]), truth[there][k]))
    return found


def told(of: List[Prediction]) -> str:
    """Mean relative error, mean deviation, share within the intervals."""
    off = [100 * (each.contrast / each.truth - 1) for each in of]
    held = [abs(each.contrast - each.truth) < 1.645 * each.error for each in of]
    return f"{sum(map(abs, off)) / len(of):.1f} % ({sum(off) / len(of):+.1f} %), {100 * sum(held) / len(of):.0f} % within 90 %, {len(of)} told"


def main() -> None:
    """A line for each angle."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--jerlov", default="1C")
    parser.add_argument("--texture", default="hull_red")
    parser.add_argument("--angles-deg", default="0,30,45,60")
    asked = parser.parse_args()
    folder = asked.folder / f"{asked.jerlov}_{asked.texture}"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "mine.toml").write_text(f'format = "uw-vehicle/1"\nwidth = {SIZE[0]}\nheight = {SIZE[1]}\n', encoding="utf-8")
    if not (folder / "water.json").exists():
        uw(folder, "water-tables", "--jerlov", asked.jerlov, "--vehicle", "mine.toml", "--depths-m", 3, "-o", "water.json")
    places = [(distance_m, light_pct) for distance_m in DISTANCES_M for light_pct in LIGHTS_PCT]
    lines = "".join(f"{distance_m},{light_pct}\n" for distance_m, light_pct in places)
    (folder / "places.csv").write_text("distance_m,light_pct\n" + lines, encoding="utf-8")
    scene = {"jerlov": asked.jerlov, "texture": asked.texture}
    for angle_deg in map(float, asked.angles_deg.split(",")):
        truth = {place: measured(folder, scene, angle_deg, place) for place in places}
        found = [one for place in places if place[0] in FROM_M for one in predicted(folder, angle_deg, place, truth)]
        kinds = (f"{kind}: {told([one for one in found if one.kind == kind])}" for kind in ("same", "nearer", "farther"))
        print(f"{asked.jerlov}, {asked.texture}, {angle_deg:g} degrees: " + "; ".join(kinds), flush=True)


if __name__ == "__main__":
    main()
