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
    "corner": "the middle of the picture half a pixel off, as where points are counted from the corner",
    "mirror": "the world mirrored: each picture's columns reversed, and the eyes exchanged",
}
RATE_HZ = 10


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


def compare(arguments):
    from reconstruction import attempt
    from reconstruction.pictures import Refused

    def tell(k, matches):
        if not arguments.quiet:
            print(f"frame {k}: {matches} matches", file=sys.stderr)

    try:
        figures, ours_m, theirs_m, frame_file = attempt.compared(arguments.folder, arguments.by, arguments.broken, tell)
    except Refused as error:
        print(f"reconstruct_sequence.py: {error}", file=sys.stderr)
        return 2
    off_pct = [figures["ate_of_path_pct"], abs(figures["scale_error_pct"]), 100 * math.radians(figures["rotation_rms_deg"])]
    figures["within"] = max(off_pct) <= arguments.within_pct
    print(json.dumps(figures, indent=1) if arguments.json else told(figures, arguments.within_pct))
    if arguments.picture:
        draw(arguments.picture, ours_m, theirs_m, frame_file)
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
    if f.get("colmap_model_residual_px") is not None:
        lines.append(f"with the poses of colmap/: reprojection error {f['colmap_model_residual_px']:.2f} px (mean)")
    if "rig_fx_pct" in f:
        lines.append(told_rig(f))
    lines.append(f"{'within' if f['within'] else 'NOT within'} {within_pct:g} % (ATE of the path, scale, rotation of a radian)")
    return "\n".join(lines)


def told_rig(f):
    return (
        f"with the true poses: residual {f['true_poses_residual_px']:.2f} px; the rig that fits them best: fx {f['rig_fx_pct']:+.3f} %, fy {f['rig_fy_pct']:+.3f} %, "
        f"cx {f['rig_cx_px']:+.3f} px, cy {f['rig_cy_px']:+.3f} px, baseline {f['rig_baseline_pct']:+.3f} %, residual {f['rig_residual_px']:.2f} px"
    )


def draw(path, ours_m, theirs_m, frame_file):
    """A frame, the two tracks from above and from the side, and how far they are apart."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplot_mosaic([["frame", "x"], ["frame", "z"], ["frame", "off"]], figsize=(11, 3.6), width_ratios=[1.1, 1], layout="constrained")
    axes["frame"].imshow(pyplot.imread(frame_file))
    axes["frame"].set_axis_off()
    for name, across in (("x", 0), ("z", 2)):
        axes[name].plot(theirs_m[:, 1], theirs_m[:, across], color="0.6", linewidth=5, label="true")
        axes[name].plot(ours_m[:, 1], ours_m[:, across], color="tab:red", linewidth=1, marker=".", markersize=3, label="from the pictures")
        axes[name].set_ylabel(f"{name}, m")
        axes[name].invert_xaxis()
    axes["x"].legend(fontsize=8, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    axes["off"].plot(1000 * ((ours_m - theirs_m) ** 2).sum(axis=1) ** 0.5, color="tab:red", linewidth=1)
    axes["z"].set_xlabel("y, m")
    axes["off"].set_xlabel("frame")
    axes["off"].set_ylabel("off by, mm")
    axes["off"].set_ylim(bottom=0)
    figure.savefig(path, dpi=100)


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
    comparing.add_argument("--by", choices=("opencv", "colmap"), default="opencv", help="what reconstructs: OpenCV with an adjustment of its own (default), or pycolmap")
    comparing.add_argument("--broken", choices=BREAKS, help="; ".join(f"{name}: {text}" for name, text in BREAKS.items()))
    comparing.add_argument("--json", action="store_true", help="print the figures as JSON")
    comparing.add_argument("--picture", type=pathlib.Path, help="a frame and the two tracks, PNG or JPEG (needs matplotlib)")
    comparing.add_argument("--quiet", action="store_true", help="nothing about single frames")
    arguments = parser.parse_args(words)
    if arguments.command == "path":
        arguments.frames = arguments.of if arguments.frames is None else arguments.frames
        if not (arguments.of >= 2 and 1 <= arguments.frames <= arguments.of):
            parser.error(f"--of must be at least 2 and --frames from 1 to it, got {arguments.of} and {arguments.frames}")
    elif (arguments.by, arguments.broken) == ("colmap", "mirror"):
        parser.error("--broken mirror goes with --by opencv alone")
    return arguments


def main(words=None):
    arguments = arguments_of(words)
    try:
        return write_path(arguments) if arguments.command == "path" else compare(arguments)
    except OSError as error:
        print(f"reconstruct_sequence.py: {error.filename}: {error.strerror}", file=sys.stderr)
    except ModuleNotFoundError as error:
        print(f"reconstruct_sequence.py: {error}; pip install numpy opencv-python-headless, and pycolmap for --by colmap", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
