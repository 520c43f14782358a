"""An estimated trajectory compared with the true one."""

import numpy as np


def alignment(ours_m, theirs_m):
    """Rotation, scale and shift that bring our points nearest to theirs (Umeyama 1991)."""
    ours, theirs = ours_m - ours_m.mean(axis=0), theirs_m - theirs_m.mean(axis=0)
    u, d, vt = np.linalg.svd(theirs.T @ ours)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    turn = u @ np.diag(sign) @ vt
    return turn, float((d * sign).sum() / (ours**2).sum())


def mean_rotation(turns):
    """The rotation nearest to all of them."""
    u, _, vt = np.linalg.svd(turns.sum(axis=0))
    return u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt


def angle_deg(turn):
    """By how much matrices turn."""
    sine = np.stack([turn[..., 2, 1] - turn[..., 1, 2], turn[..., 0, 2] - turn[..., 2, 0], turn[..., 1, 0] - turn[..., 0, 1]], axis=-1)
    return np.degrees(np.arctan2(np.linalg.norm(sine, axis=-1), np.trace(turn, axis1=-2, axis2=-1) - 1))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def relative(positions_m, rotations, step):
    """Motions over `step` frames in the camera where they begin."""
    turn = np.swapaxes(rotations[:-step], 1, 2)
    return np.einsum("kij,kj->ki", turn, positions_m[step:] - positions_m[:-step]), turn @ rotations[step:]


def compare(ours, theirs, distance_m):
    """Figures of positions and rotations (ours, theirs); scale is that which ours would have to be multiplied with to be theirs, less 1."""
    (ours_m, our_turns), (theirs_m, their_turns) = ours, theirs
    turn, scale = alignment(ours_m, theirs_m)
    aligned_m = (ours_m - ours_m.mean(axis=0)) @ turn.T + theirs_m.mean(axis=0)
    # Positions along nearly a line do not say how it is rolled, so rotations have an alignment of their own.
    aligned_turns = mean_rotation(their_turns @ np.swapaxes(our_turns, 1, 2)) @ our_turns
    path_m = float(np.linalg.norm(np.diff(theirs_m, axis=0), axis=1).sum())
    off_m = np.linalg.norm(aligned_m - theirs_m, axis=1)
    off_deg = angle_deg(np.swapaxes(their_turns, 1, 2) @ aligned_turns)
    figures = {
        "frames": len(ours_m),
        "path_m": path_m,
        "distance_m": distance_m,
        "ate_rmse_m": rms(off_m),
        "ate_of_path_pct": 100 * rms(off_m) / path_m,
        "ate_of_distance_pct": 100 * rms(off_m) / distance_m,
        "scale_error_pct": 100 * (scale - 1),
        "rotation_rms_deg": rms(off_deg),
        "rotation_max_deg": float(off_deg.max()),
    }
    for step in (1, 10):
        if len(ours_m) > step:
            figures |= relative_figures(ours, theirs, step)
    return figures, aligned_m


def rig_figures(found, told):
    """By how much a rig that was found differs from what camera.json says of it."""
    fx, fy, cx, cy, baseline_m = found
    return {
        "rig_fx_pct": 100 * (fx / told[0] - 1),
        "rig_fy_pct": 100 * (fy / told[1] - 1),
        "rig_cx_px": float(cx - told[2]),
        "rig_cy_px": float(cy - told[3]),
        "rig_baseline_pct": 100 * (baseline_m / told[4] - 1),
    }


def relative_figures(ours, theirs, step):
    (our_m, our_turn), (their_m, their_turn) = relative(*ours, step), relative(*theirs, step)
    off_m = np.linalg.norm(our_m - their_m, axis=1)
    return {
        f"relative_{step}_rmse_m": rms(off_m),
        f"relative_{step}_pct": 100 * rms(off_m) / rms(np.linalg.norm(their_m, axis=1)),
        f"relative_{step}_rotation_rms_deg": rms(angle_deg(np.swapaxes(their_turn, 1, 2) @ our_turn)),
    }
