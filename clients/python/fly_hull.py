"""A flight along a ship's hull, advised by `uwguide`, with rendered pictures as its eyes.

    python3 clients/python/fly_hull.py OUT [--jerlov TYPE] [--stops N] [--distance-m D] [--level-pct L] [--programs DIR]

Calibrates in the water as an operator would (`uw demo`, whose water is fitted to pictures), then flies: at each stop a picture (`uw sequence`, the
hull of the shipped scene `hull_side`), the daemon's advice on it, a move to the distance and lamps that it suggests, and on along the hull. Where advice is
refused the vehicle goes nearer, as the daemon's message says. At the last stop it also looks with what it began with. OUT/flight.md
has the table and shows that stop before and after. A flight that was interrupted goes on with the same command. Needs the programs `uw` and `uwguide` in PATH or DIR, and no package.
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import sys

from uwguide import Client

# The shipped vehicle with a smaller picture.
VEHICLE = 'format = "uw-vehicle/1"\nwidth = 480\nheight = 270\n'
# Camera, lamps and sensor of `flat_hull` are those of that vehicle; before them comes the hull of `hull_side`, whose plating stands at x = 0.
SCENE = "flat_hull"
HULL = 'object=[{ gltf = "hull_side.glb", translation_m = [0.0, 0.0, -2.6] }]'
DEPTH_M = 2.6
# Where the flight begins, and how much of a picture the next one shows again.
BEGIN_Y_M = 1.5
OVERLAP = 0.3
# Farthest that the vehicle goes towards or away from the hull at once, and what it does without advice.
STEP_M = 0.6
NEARER_M = 0.4
LIMITS_M = (0.5, 3.0)


class Eyes:
    """The vehicle's camera: pictures of the hull from where it is, with its lamps."""

    def __init__(self, uw, out, jerlov):
        self.command, self.out = [uw, "sequence", SCENE], out
        self.more = ["--width", "480", "--spp", "8", "--denoise", "--quiet", "--set", HULL, "--set", f"water.jerlov={jerlov}"]

    def look(self, name, y_m, distance_m, level_pct):
        """Takes a picture; its name below `out`."""
        path = self.out / f"{name}.csv"
        header = "time_s,tx,ty,tz,forward_x,forward_y,forward_z,level_pct"
        path.write_text(f"{header}\n0,{-distance_m:.4f},{y_m:.4f},{-DEPTH_M},1,0,0,{level_pct:.2f}\n")
        subprocess.run([*self.command, path, "-o", self.out / name, *self.more], check=True)
        picture = f"{name}.png"
        shutil.copy(self.out / name / "rgb" / "000000.png", self.out / picture)
        return picture


def start(uwguide, out, calibration):
    """The daemon, and its address."""
    config = out / "uwguide.toml"
    config.write_text(f'format = "uwguide-config/1"\n[images]\ndirectory = {json.dumps(str(out.resolve()))}\n')
    files = ["--water", calibration / "water.json", "--profile", calibration / "profile.json", "--vehicle", out / "vehicle.toml"]
    daemon = subprocess.Popen(
        [uwguide, *files, "--config", config, "--listen", "127.0.0.1:0"], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
    )
    for line in daemon.stderr:
        if "listening on" in line:
            return daemon, line.split()[-1]
    raise SystemExit(f"fly_hull.py: the daemon ended with {daemon.wait()}")


def fly(eyes, client, arguments):
    """Stop by stop; rows of the table."""
    distance_m, level_pct, y_m = arguments.distance_m, arguments.level_pct, BEGIN_Y_M
    for stop in range(arguments.stops):
        picture = eyes.look(f"stop_{stop}", y_m, distance_m, level_pct)
        advice = client.suggest_image(picture, depth_m=DEPTH_M, distance_m=distance_m, light_pct=level_pct)
        row = {"stop": stop, "y_m": y_m, "picture": picture, "distance_m": distance_m, "level_pct": level_pct, "advice": advice}
        print(told(row), flush=True)
        yield row
        if advice["valid"] and advice["action"] == "move":
            change_m, level_pct = advice["delta_distance_m"], advice["light_pct"]
        else:
            change_m = 0.0 if advice["valid"] else -NEARER_M
        distance_m += max(-STEP_M, min(STEP_M, change_m))
        distance_m = max(LIMITS_M[0], min(LIMITS_M[1], distance_m))
        # What is seen of the hull is as wide as twice the distance times tan 30 degrees.
        y_m -= (1 - OVERLAP) * 2 * 0.577 * distance_m


def told(row):
    """A stop in words."""
    advice = row["advice"]
    at = f"stop {row['stop']}: {row['distance_m']:.2f} m, lamps {row['level_pct']:.0f} %, contrast {counts(advice.get('std'))}"
    if not advice["valid"]:
        return f"{at}; no advice ({advice['reason']}), nearer"
    if advice["action"] == "hold":
        return f"{at}; stay"
    expected = counts(advice["predicted_contrast"])
    return f"{at}; to {advice['distance_m']:.2f} m, lamps {advice['light_pct']:.0f} %, {expected} expected"


def counts(of):
    """Contrast of R, G and B."""
    return "?" if of is None else " ".join(f"{value:.1f}" for value in of)


def report(out, arguments, rows, first):
    """OUT/flight.md and OUT/flight.json."""
    (out / "flight.json").write_text(json.dumps(rows, indent=1) + "\n")
    last = rows[-1]
    lines = [
        "# A flight along a hull",
        "",
        f"Jerlov {arguments.jerlov} water, {DEPTH_M} m deep, from {arguments.distance_m:g} m with lamps at {arguments.level_pct:g} %. {told(last).capitalize()}.",
        "",
        "| the last stop, seen with what the flight began with | seen as advised |",
        "|---|---|",
        f"| ![before]({first}) | ![after]({last['picture']}) |",
        "",
        *[f"* {told(row)}" for row in rows],
        "",
    ]
    (out / "flight.md").write_text("\n".join(lines))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=pathlib.Path, help="folder to write")
    parser.add_argument("--jerlov", default="3C", help="the water (3C)")
    parser.add_argument("--stops", type=int, default=6, choices=range(1, 7), help="stops along the hull, which is 12 m long: 1 to 6 (6)")
    parser.add_argument("--distance-m", type=float, default=2.4, help="where it begins, from the hull (2.4)")
    parser.add_argument("--level-pct", type=float, default=100.0, help="lamps at the beginning (100)")
    parser.add_argument("--programs", type=pathlib.Path, help="folder of uw and uwguide")
    arguments = parser.parse_args()
    for name, value, (least, most) in (("--distance-m", arguments.distance_m, LIMITS_M), ("--level-pct", arguments.level_pct, (0, 100))):
        if not least <= value <= most:
            parser.error(f"{name} must be in [{least}, {most}], got {value}")
    uw, uwguide = [str(arguments.programs / name) if arguments.programs else name for name in ("uw", "uwguide")]
    for program in (uw, uwguide):
        if not shutil.which(program):
            parser.error(f"{program} is not there; build it, and name its folder with --programs")
    out = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    (out / "vehicle.toml").write_text(VEHICLE)
    calibration = out / f"calibration_{arguments.jerlov}"
    if not (calibration / "report.md").exists():
        water = ["--jerlov", arguments.jerlov, "--target", "hull_black_fouled"]
        subprocess.run([uw, "demo", "--vehicle", out / "vehicle.toml", *water, "-o", calibration], check=True)
    daemon, address = start(uwguide, out, calibration)
    try:
        eyes = Eyes(uw, out, arguments.jerlov)
        with Client(address) as client:
            print(f"advice by {client.info()['predictor']}", flush=True)
            rows = list(fly(eyes, client, arguments))
        first = eyes.look("before", rows[-1]["y_m"], arguments.distance_m, arguments.level_pct)
        report(out, arguments, rows, first)
    finally:
        daemon.terminate()
        daemon.wait()
    print(f"Read {out / 'flight.md'}.")


if __name__ == "__main__":
    sys.exit(main())
