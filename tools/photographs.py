#!/usr/bin/env python3
"""What a calibration from photographs is worth: the stand-ins of docs/howto/photographs.md against an ideal camera and the truth.

    python3 tools/doc_commands.py --run docs/howto/photographs.md --folder DIR    # makes the stand-ins in an empty folder
    python3 tools/photographs.py DIR                                              # needs uw in the path; four minutes of processor time

Prints a line for each way to calibrate: contrast without noise against that of the ideal camera's pictures, and what `uw fit` finds against
the water that was rendered.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Dict, List

TRUTH = {"a": [0.385, 0.107, 0.124], "b": [0.276, 0.368, 0.522], "backscatter_fraction": 0.0183}  # uw water --jerlov 1C --bands mean
SHORTEST = 4.305  # `exposure` of the shortest of the stand-ins' pictures
HEADER = "file,kind,depth_m,distance_m,light_pct\n"
VEHICLE = 'format = "uw-vehicle/1"\nwidth = {}\nheight = {}\nhfov_deg = {}\nexposure = {}\nlamp_intensity = {}\n'
PLACES = [(distance, light) for distance in ("0.5", "0.75", "1.1", "1.6", "2.3") for light in (0, 100)]


def uw(folder: Path, *arguments: object) -> None:
    """Runs `uw` in the folder; its warnings are not shown."""
    subprocess.run(["uw", *map(str, arguments)], cwd=folder, check=True, capture_output=True)


def without_exif(jpeg: bytes) -> bytes:
    """A JPEG without its APP1 segments."""
    kept, at = jpeg[:2], 2
    while jpeg[at] == 0xFF and jpeg[at + 1] != 0xDA:
        end = at + 2 + int.from_bytes(jpeg[at + 2:at + 4], "big")
        kept += b"" if jpeg[at + 1] == 0xE1 else jpeg[at:end]
        at = end
    return kept + jpeg[at:]


def prepare(folder: Path) -> None:
    """Pictures of the ideal camera, and photographs without EXIF."""
    text = (folder / "dive.toml").read_text(encoding="utf-8")
    ideal = [line for line in text.splitlines() if not line.startswith("fisheye")]
    changed = {"hfov_deg = 80.0": "hfov_deg = 60.0", "width = 320": "width = 240", "height = 180": "height = 136", "exposure = 8.61": f"exposure = {SHORTEST}"}
    (folder / "ideal.toml").write_text("\n".join(changed.get(line, line) for line in ideal) + "\n", encoding="utf-8")
    rows: Dict[str, str] = {"ideal": HEADER, "no_exif": HEADER}
    for seed, (distance, light) in enumerate(PLACES):
        name = f"{distance}_{light}"
        levels = [word for lamp in ("left", "right") for word in ("--set", f"lamp.{lamp}.level_pct={light}")]
        uw(folder, "render", "ideal.toml", "-o", "ideal.exr", "--spp", 16, "--denoise", "--quiet", "--set", f"object.0.plane.center_m.0={distance}", *levels)
        uw(folder, "sensor", "ideal.exr", "ideal.toml", "-o", f"ideal_{name}.png", "--seed", seed)
        (folder / f"no_exif_{name}.jpg").write_bytes(without_exif((folder / f"wall_{name}.jpg").read_bytes()))
        rows["ideal"] += f"ideal_{name}.png,contrast,3,{distance},{light}\n"
        rows["no_exif"] += f"no_exif_{name}.jpg,contrast,3,{distance},{light}\n"
    for name, text in rows.items():
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")
    for name, numbers in {"known": (240, 136, 60, SHORTEST, 0.4), "unknown": (240, 136, 60, SHORTEST, 0.13), "no_lens": (320, 180, 80, SHORTEST, 0.4)}.items():
        (folder / f"{name}.toml").write_text(VEHICLE.format(*numbers), encoding="utf-8")


def contrasts(folder: Path, profile: str) -> List[float]:
    """Contrasts without noise of a profile: on, then off, by distance and channel."""
    corrected = json.loads((folder / profile).read_text(encoding="utf-8"))["noise_corrected"]
    return [value for which in ("on", "off") for sample in corrected[which] for value in sample["k_c"]]


def percent(found: List[float], right: List[float]) -> str:
    """What found numbers are off the right ones."""
    return " ".join(f"{100 * (x / y - 1):+.0f}" for x, y in zip(found, right))


def report(folder: Path, name: str, manifest: str, vehicle: str, options: List[str], of_fit: List[str]) -> None:
    """Calibrates and fits, and prints how far that is off."""
    uw(folder, "calibrate", manifest, "--vehicle", vehicle, *options, "--jerlov", "1C", "-o", "profile.json")
    found, right = contrasts(folder, "profile.json"), contrasts(folder, "ideal.json")
    half = len(right) // 2
    off = [abs(x / y - 1) for x, y in zip(found, right)]
    uw(folder, "fit", manifest, "--vehicle", vehicle, *options, *of_fit, "-o", "water.json", "--kilo-paths", 16, "--table-kilo-paths", 8)
    file = json.loads((folder / "water.json").read_text(encoding="utf-8"))
    water, fit = file["water"], file["fit"]
    print(
        f"{name}: contrast off by {100 * sum(off[:half]) / half:.0f} % (lamps on), {100 * sum(off[half:]) / half:.0f} % (off); "
        f"a {percent(water['a_per_m'], TRUTH['a'])} %, b {percent(water['b_per_m'], TRUTH['b'])} %, B {water['backscatter_fraction']:.4f}, "
        f"lamps {' '.join(f'{gain:.2f}' for gain in fit['lamp_gain'])}",
        flush=True,
    )


def main() -> int:
    """Prepares the pictures and reports on each way."""
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    folder = Path(sys.argv[1])
    prepare(folder)
    uw(folder, "calibrate", "ideal.csv", "--vehicle", "known.toml", "--jerlov", "1C", "-o", "ideal.json")
    lens = ["--camera", "dive.toml"]
    report(folder, "ideal camera, one exposure", "ideal.csv", "known.toml", [], [])
    report(folder, "photographs", "dive.csv", "known.toml", lens, [])
    report(folder, "photographs, Jerlov water", "dive.csv", "known.toml", lens, ["--jerlov"])
    report(folder, "photographs, lamp unknown (a third of it in the file)", "dive.csv", "unknown.toml", lens, [])
    report(folder, "the same, --gain-error 1.5", "dive.csv", "unknown.toml", lens, ["--gain-error", "1.5"])
    report(folder, "lens left in", "dive.csv", "no_lens.toml", [], [])
    report(folder, "EXIF lost", "no_exif.csv", "known.toml", lens, [])
    return 0


if __name__ == "__main__":
    sys.exit(main())
