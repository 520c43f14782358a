"""One reconstruction of a folder, compared with its truth."""

import numpy as np

from . import comparison, odometry
from .adjustment import PointsUnknown, Problem, RigUnknown, State, adjust, adjust_twice
from .pictures import Refused, picture_files, read_rig, read_truth

# What is broken on purpose is too long by that factor.
BREAK_FACTOR = 1.03
LEAST_FRAMES = 3


def read_broken(folder, broken):
    """Times, pictures of both eyes and rig, with what is broken on purpose."""
    rig = read_rig(folder)
    times, left, right = picture_files(folder)
    if len(times) < LEAST_FRAMES:
        raise Refused(f"{folder}: {len(times)} frames, at least {LEAST_FRAMES} are needed")
    if broken == "fx":
        rig.matrix[0, 0] *= BREAK_FACTOR
        rig.matrix[1, 1] *= BREAK_FACTOR
    if broken == "baseline":
        rig.baseline_m *= BREAK_FACTOR
    if broken == "corner":
        rig.matrix[:2, 2] += 0.5
    if broken == "mirror":
        left, right = right, left
        rig.matrix[0, 2] = rig.size_px[0] - 1 - rig.matrix[0, 2]
    return times, left, right, rig


def reconstruct(left, right, rig, mirrored, tell):
    """What was seen where, and the state that goes with it best."""
    turns, shifts_m, tracks = odometry.run(left, right, rig, mirrored, tell)
    problem = Problem(tracks.frames, tracks.points, tracks.seen_px)
    return adjust_twice(problem, State(turns, shifts_m, np.array(tracks.places_m), rig.numbers))


def with_truth(problem, state, truth):
    """Residuals where the poses are the true ones, and the rig that the pictures then say."""
    positions_m, rotations = truth
    to_cameras = np.swapaxes(rotations, 1, 2)
    shifts_m = np.einsum("kij,kj->ki", to_cameras, positions_m[0] - positions_m)
    true = adjust(problem, state._replace(turns=to_cameras @ rotations[0], shifts_m=shifts_m), PointsUnknown())
    found = adjust(problem, true, RigUnknown())
    figures = {"true_poses_residual_px": problem.residual_rms_px(true)}
    return figures | comparison.rig_figures(found.rig, state.rig) | {"rig_residual_px": problem.residual_rms_px(found)}


def by_opencv(folder, broken, truth, tell):
    """Positions and rotations of a track, the distance of what is seen, m, and figures of its own."""
    _, left, right, rig = read_broken(folder, broken)
    problem, state = reconstruct(left, right, rig, broken == "mirror", tell)
    rotations = np.swapaxes(state.turns, 1, 2)
    positions_m = -np.einsum("kij,kj->ki", rotations, state.shifts_m)
    seen = {"points": len(np.unique(problem.points)), "observations": len(problem.points), "residual_px": problem.residual_rms_px(state)}
    distance_m = float(np.median(problem.in_cameras(state)[:, 2]))
    return positions_m, rotations, distance_m, seen | with_truth(problem, state, truth)


def by_colmap(folder, broken):
    """The same by COLMAP."""
    from . import colmap  # needs a package of its own

    _, left, right, rig = read_broken(folder, broken)
    positions_m, rotations, distance_m, seen = colmap.track(folder, left, right, rig)
    return positions_m, rotations, distance_m, seen | {"colmap_model_residual_px": colmap.known_poses_residual_px(folder)}


def compared(folder, by, broken, tell):
    """Figures, the two tracks, and the file of the frame in the middle."""
    times, files, _, _ = read_broken(folder, broken)
    truth = read_truth(folder, times)
    positions_m, rotations, distance_m, own = by_colmap(folder, broken) if by == "colmap" else by_opencv(folder, broken, truth, tell)
    figures, aligned_m = comparison.compare((positions_m, rotations), truth, distance_m)
    return own | figures, aligned_m, truth[0], files[len(files) // 2]
