"""The track of a stereo camera from its pictures alone, compared with the true one.

    pip install numpy opencv-python-headless
    python3 tools/reconstruct_sequence.py path hull_path.csv                # a track along the shipped scene `hull_side`
    uw sequence hull_side hull_path.csv -o hull --stereo 0.12 --denoise
    python3 tools/reconstruct_sequence.py compare hull

Features (SIFT) are matched between the eyes and from frame to frame, motions come from PnP, and one bundle adjustment of all poses and points ends it. Pictures and
camera.json are all it looks at; groundtruth.txt is what the track is compared with. Both tracks are laid on each other by a rotation and a shift, without scale, which is the baseline's.
Then the same points are placed with the true poses, and the rig is looked for that fits them best. Exit status 1 where the track, its scale or its rotations are off by
more than --within-pct, 2 where nothing can be reconstructed.
"""

import argparse
import json
import math
import pathlib
import sys

BREAKS = {
    "fx": "focal lengths 3 %% too long",
    "baseline": "baseline 3 %% too long",
    "mirror": "the world mirrored: each picture's columns reversed, and the eyes exchanged",
}
BREAK_FACTOR = 1.03
RATE_HZ = 10
LEAST_FRAMES = 3


def hull_pose(share):
    """Position, m, forward and up on a track along the hull of `hull_side`, which swings, nods and rolls; share runs from 0 to 1."""

    def wave(turns, phase=0.0):
        return math.sin(2 * math.pi * turns * share + phase)

    position_m = (-1.35 + 0.15 * wave(1.5), 2.6 - 5.2 * share, -2.6 + 0.25 * wave(2))
    yaw, pitch, roll = (math.radians(angle) for angle in (30 + 22 * wave(1.25), 8 * wave(1.5, 1.0), 10 * wave(1)))
    forward = (math.cos(pitch) * math.cos(yaw), -math.cos(pitch) * math.sin(yaw), math.sin(pitch))
    right = (-math.sin(yaw), -math.cos(yaw), 0.0)
    upright = (right[1] * forward[2], -right[0] * forward[2], right[0] * forward[1] - right[1] * forward[0])
    up = tuple(math.cos(roll) * u + math.sin(roll) * r for u, r in zip(upright, right))
    return position_m, forward, up


def write_path(arguments):
    lines = ["time_s,tx,ty,tz,forward_x,forward_y,forward_z,up_x,up_y,up_z"]
    for k in range(arguments.frames):
        numbers = [x for vector in hull_pose(k / (arguments.of - 1)) for x in vector]
        lines.append(",".join([f"{k / RATE_HZ:.1f}", *(f"{x:.6f}" for x in numbers)]))
    arguments.csv.write_text("\n".join(lines) + "\n")


def read_broken(folder, broken):
    """Times, pictures of both eyes and rig, with what is broken on purpose."""
    from reconstruction import pictures

    rig = pictures.read_rig(folder)
    times, left, right = pictures.picture_files(folder)
    if len(times) < LEAST_FRAMES:
        raise pictures.Refused(f"{folder}: {len(times)} frames, at least {LEAST_FRAMES} are needed")
    if broken == "fx":
        rig.matrix[0, 0] *= BREAK_FACTOR
        rig.matrix[1, 1] *= BREAK_FACTOR
    if broken == "baseline":
        rig.baseline_m *= BREAK_FACTOR
    if broken == "mirror":
        left, right = right, left
        rig.matrix[0, 2] = rig.size_px[0] - 1 - rig.matrix[0, 2]
    return times, left, right, rig


def reconstruct(left, right, rig, mirrored, tell):
    """What was seen where, and the state that goes with it best."""
    from reconstruction import adjustment, odometry
    import numpy as np

    turns, shifts_m, tracks = odometry.run(left, right, rig, mirrored, tell)
    problem = adjustment.Problem(tracks.frames, tracks.points, tracks.seen_px)
    return adjustment.adjust_twice(problem, adjustment.State(turns, shifts_m, np.array(tracks.places_m), rig.numbers))


def with_truth(problem, state, truth):
    """Residuals where the poses are the true ones, and the rig that the pictures then say."""
    from reconstruction import adjustment, comparison
    import numpy as np

    positions_m, rotations = truth
    to_cameras = np.swapaxes(rotations, 1, 2)
    shifts_m = np.einsum("kij,kj->ki", to_cameras, positions_m[0] - positions_m)
    true = adjustment.adjust(problem, state._replace(turns=to_cameras @ rotations[0], shifts_m=shifts_m), adjustment.Nothing())
    found = adjustment.adjust(problem, true, adjustment.Rig())
    figures = {"true_poses_residual_px": problem.residual_rms_px(true)}
    return figures | comparison.rig_figures(found.rig, state.rig) | {"rig_residual_px": problem.residual_rms_px(found)}


def compared(folder, broken, tell):
    """Figures, and the two tracks."""
    from reconstruction import comparison, pictures
    import numpy as np

    times, left, right, rig = read_broken(folder, broken)
    truth = pictures.read_truth(folder, times)
    problem, state = reconstruct(left, right, rig, broken == "mirror", tell)
    rotations = np.swapaxes(state.turns, 1, 2)
    positions_m = -np.einsum("kij,kj->ki", rotations, state.shifts_m)
    distance_m = float(np.median(problem.in_cameras(state)[:, 2]))
    figures, aligned_m = comparison.compare((positions_m, rotations), truth, distance_m)
    seen = {"points": len(np.unique(problem.points)), "observations": len(problem.points), "residual_px": problem.residual_rms_px(state)}
    return seen | figures | with_truth(problem, state, truth), aligned_m, truth[0]


def compare(arguments):
    from reconstruction import pictures

    def tell(k, matches):
        if not arguments.quiet:
            print(f"frame {k}: {matches} matches", file=sys.stderr)

    try:
        figures, ours_m, theirs_m = compared(arguments.folder, arguments.broken, tell)
    except pictures.Refused as error:
        print(f"reconstruct_sequence.py: {error}", file=sys.stderr)
        return 2
    off_pct = [figures["ate_of_path_pct"], abs(figures["scale_error_pct"]), 100 * math.radians(figures["rotation_rms_deg"])]
    figures["within"] = max(off_pct) <= arguments.within_pct
    print(json.dumps(figures, indent=1) if arguments.json else told(figures, arguments.within_pct))
    if arguments.picture:
        draw(arguments.picture, ours_m, theirs_m)
    return 0 if figures["within"] else 1


def told(f, within_pct):
    lines = [
        f"{f['frames']} frames along {f['path_m']:.2f} m, {f['distance_m']:.2f} m away (median)",
        f"{f['points']} points seen {f['observations']} times, residual {f['residual_px']:.2f} px",
        f"position: ATE {1000 * f['ate_rmse_m']:.1f} mm (rms), {f['ate_of_path_pct']:.3f} % of the path, {f['ate_of_distance_pct']:.2f} % of the distance",
        f"scale: off by {f['scale_error_pct']:+.3f} %",
        f"rotation: off by {f['rotation_rms_deg']:.3f} degrees (rms), {f['rotation_max_deg']:.3f} at most",
    ]
    for step in (1, 10):
        if f"relative_{step}_pct" in f:
            rotation_deg = f[f"relative_{step}_rotation_rms_deg"]
            lines.append(f"over {step} frames: {1000 * f[f'relative_{step}_rmse_m']:.2f} mm, {f[f'relative_{step}_pct']:.2f} % of the way, {rotation_deg:.3f} degrees")
    lines.append(
        f"with the true poses: residual {f['true_poses_residual_px']:.2f} px; the rig that fits them best: fx {f['rig_fx_pct']:+.3f} %, fy {f['rig_fy_pct']:+.3f} %, "
        f"cx {f['rig_cx_px']:+.3f} px, cy {f['rig_cy_px']:+.3f} px, baseline {f['rig_baseline_pct']:+.3f} %, residual {f['rig_residual_px']:.2f} px"
    )
    lines.append(f"{'within' if f['within'] else 'NOT within'} {within_pct:g} % (ATE of the path, scale, rotation of a radian)")
    return "\n".join(lines)


def draw(path, ours_m, theirs_m):
    """The two tracks from above and from the side."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 1, figsize=(7, 4.2), sharex=True, layout="constrained")
    for axis, (across, name) in zip(axes, ((0, "x"), (2, "z"))):
        axis.plot(theirs_m[:, 1], theirs_m[:, across], color="0.6", linewidth=4, label="true")
        axis.plot(ours_m[:, 1], ours_m[:, across], color="tab:red", linewidth=1, marker=".", markersize=3, label="from the pictures")
        axis.set_ylabel(f"{name}, m")
        axis.set_aspect("equal")
    axes[0].legend()
    axes[1].set_xlabel("y, m")
    figure.savefig(path, dpi=110)


def arguments_of(words):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    path = commands.add_parser("path", help="write a trajectory along the hull of `hull_side`")
    path.add_argument("csv", type=pathlib.Path, help="file to write")
    path.add_argument("--of", type=int, default=100, help="frames of the whole track (100)")
    path.add_argument("--frames", type=int, help="frames to write, from the first on (all)")
    comparing = commands.add_parser("compare", help="reconstruct a folder of `uw sequence --stereo` and compare it with its truth")
    comparing.add_argument("folder", type=pathlib.Path, help="folder of the sequence")
    comparing.add_argument("--within-pct", type=float, default=1.0, help="largest ATE, of the path, error of scale and of rotation, of a radian (1)")
    comparing.add_argument("--broken", choices=BREAKS, help="; ".join(f"{name}: {text}" for name, text in BREAKS.items()))
    comparing.add_argument("--json", action="store_true", help="print the figures as JSON")
    comparing.add_argument("--picture", type=pathlib.Path, help="PNG of the two tracks (needs matplotlib)")
    comparing.add_argument("--quiet", action="store_true", help="nothing about single frames")
    arguments = parser.parse_args(words)
    if arguments.command == "path":
        arguments.frames = arguments.of if arguments.frames is None else arguments.frames
        if not (arguments.of >= 2 and 1 <= arguments.frames <= arguments.of):
            parser.error(f"--of must be at least 2 and --frames from 1 to it, got {arguments.of} and {arguments.frames}")
    return arguments


def main(words=None):
    arguments = arguments_of(words)
    try:
        return write_path(arguments) if arguments.command == "path" else compare(arguments)
    except OSError as error:
        print(f"reconstruct_sequence.py: {error.filename}: {error.strerror}", file=sys.stderr)
    except ModuleNotFoundError as error:
        print(f"reconstruct_sequence.py: {error}; pip install numpy opencv-python-headless", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
