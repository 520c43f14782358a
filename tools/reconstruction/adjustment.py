"""Bundle adjustment of a stereo pair's poses and of points: damped least squares, points eliminated (Schur complement), robust weights."""

from typing import NamedTuple

import numpy as np

# Residuals beyond that count linearly (Huber).
HUBER_PX = 1.0
STEPS = 30
SETTLED = 1e-6
# Points whose blocks are dense at once; what memory is needed follows from it.
CHUNK = 1500
# Observations that are off by more after the first adjustment are left out of the second.
OUTLIER_PX = 3.0


class State(NamedTuple):
    """What is adjusted: rotations and shifts from the first camera to each, points in the first, and the rig: fx, fy, cx, cy in pixels, baseline in m."""

    turns: np.ndarray
    shifts_m: np.ndarray
    places_m: np.ndarray
    rig: np.ndarray


class Problem:
    """Observations, sorted by point: frame, point, and left column, row and right column (NaN where unknown)."""

    def __init__(self, frames, points, seen_px):
        order = np.argsort(points, kind="stable")
        self.frames, self.points, self.seen_px = np.asarray(frames)[order], np.asarray(points)[order], np.asarray(seen_px)[order]
        self.known = np.isfinite(self.seen_px)

    def without(self, bad):
        """The same without some observations."""
        return Problem(self.frames[~bad], self.points[~bad], self.seen_px[~bad])

    def in_cameras(self, state):
        return np.einsum("oij,oj->oi", state.turns[self.frames], state.places_m[self.points]) + state.shifts_m[self.frames]

    def residuals_px(self, state):
        fx, fy, cx, cy, baseline_m = state.rig
        x, y, z = self.in_cameras(state).T
        projected_px = np.stack([fx * x / z + cx, fy * y / z + cy, fx * (x - baseline_m) / z + cx], axis=1)
        return np.where(self.known, projected_px - self.seen_px, 0.0)

    def residual_rms_px(self, state):
        return float(np.sqrt(np.mean(self.residuals_px(state)[self.known] ** 2)))

    def by_point(self, state):
        """Derivatives of the projection by the point in the camera."""
        fx, fy, _, _, baseline_m = state.rig
        x, y, z = self.in_cameras(state).T
        none = np.zeros_like(x)
        left = np.stack([fx / z, none, -fx * x / z**2], axis=1)
        row = np.stack([none, fy / z, -fy * y / z**2], axis=1)
        right = np.stack([fx / z, none, -fx * (x - baseline_m) / z**2], axis=1)
        return np.stack([left, row, right], axis=1) * self.known[:, :, None]


class PosesUnknown:
    """Poses are unknown but for the first one, the rig is known."""

    fixed = 6

    def derivatives(self, problem, state, by_point):
        from_centre_m = problem.in_cameras(state) - state.shifts_m[problem.frames]
        return np.concatenate([by_point @ -cross_matrices(from_centre_m), by_point], axis=2), problem.frames, len(state.turns)

    def moved(self, state, steps):
        return state._replace(turns=turned_by(steps[:, :3]) @ state.turns, shifts_m=state.shifts_m + steps[:, 3:])


class PointsUnknown:
    """Poses and rig are known; points move alone."""

    fixed = 1

    def derivatives(self, problem, state, by_point):
        return np.zeros((len(by_point), 3, 1)), np.zeros(len(by_point), int), 1

    def moved(self, state, steps):
        return state


class RigUnknown:
    """The rig is unknown, poses are known."""

    fixed = 0

    def derivatives(self, problem, state, by_point):
        fx, _, _, _, baseline_m = state.rig
        x, y, z = problem.in_cameras(state).T
        none, one = np.zeros_like(x), np.ones_like(x)
        left = np.stack([x / z, none, one, none, none], axis=1)
        row = np.stack([none, y / z, none, one, none], axis=1)
        right = np.stack([(x - baseline_m) / z, none, one, none, -fx / z], axis=1)
        return np.stack([left, row, right], axis=1) * problem.known[:, :, None], np.zeros(len(x), int), 1

    def moved(self, state, steps):
        return state._replace(rig=state.rig + steps[0])


def cross_matrices(vectors):
    x, y, z = vectors.T
    none = np.zeros_like(x)
    return np.stack([none, -z, y, z, none, -x, -y, x, none], axis=1).reshape(-1, 3, 3)


def turned_by(vectors):
    """Rotations about vectors by their lengths (Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    k = cross_matrices(vectors)
    small = np.maximum(angle, 1e-12)
    return np.eye(3) + np.sin(angle) / small * k + (1 - np.cos(angle)) / small**2 * (k @ k)


def weights(residuals_px):
    size = np.linalg.norm(residuals_px, axis=1)
    return np.minimum(1.0, HUBER_PX / np.maximum(size, 1e-12))


def cost(residuals_px):
    size = np.linalg.norm(residuals_px, axis=1)
    return float(np.where(size < HUBER_PX, size**2 / 2, HUBER_PX * (size - HUBER_PX / 2)).sum())


def summed(blocks, index, count):
    """Sums of blocks that have the same index."""
    total = np.zeros((count, *blocks.shape[1:]))
    np.add.at(total, index, blocks)
    return total


class Normal:
    """Normal equations in blocks: of cameras (or of the one rig), of points, and between them."""

    def __init__(self, problem, of_camera, of_point, residuals_px, cameras, camera_index, points):
        weight = weights(residuals_px)[:, None, None]
        weighted_camera, weighted_point = weight * of_camera, weight * of_point
        self.index, self.points, self.cameras = camera_index, problem.points, cameras
        self.aa = summed(np.einsum("oki,okj->oij", weighted_camera, of_camera), camera_index, cameras)
        self.pp = summed(np.einsum("oki,okj->oij", weighted_point, of_point), problem.points, points)
        self.ap = np.einsum("oki,okj->oij", weighted_camera, of_point)
        self.a = -summed(np.einsum("oki,ok->oi", weighted_camera, residuals_px), camera_index, cameras)
        self.p = -summed(np.einsum("oki,ok->oi", weighted_point, residuals_px), problem.points, points)

    def solved(self, damping, fixed):
        """Steps of cameras and points; the first `fixed` unknowns of the cameras stay."""
        width = self.aa.shape[1]
        size = self.cameras * width
        reduced, right = np.zeros((size, size)), self.a.reshape(-1).copy()
        for c in range(self.cameras):
            at = slice(c * width, (c + 1) * width)
            reduced[at, at] = self.aa[c] + np.diag(damping * np.diag(self.aa[c]) + 1e-9)
        diagonal = np.einsum("pii->pi", self.pp)
        damped = self.pp + np.eye(3) * (damping * diagonal + 1e-9)[:, None, :]
        inverse = np.linalg.inv(damped)
        for begin in range(0, len(self.pp), CHUNK):
            self.eliminate(reduced, right, inverse, begin, width)
        steps = np.zeros(size)
        steps[fixed:] = np.linalg.solve(reduced[fixed:, fixed:], right[fixed:])
        steps = steps.reshape(self.cameras, width)
        pull = summed(np.einsum("oij,oi->oj", self.ap, steps[self.index]), self.points, len(self.pp))
        return steps, np.einsum("pij,pj->pi", inverse, self.p - pull)

    def eliminate(self, reduced, right, inverse, begin, width):
        """Takes a chunk of points out of the cameras' equations."""
        end = min(begin + CHUNK, len(inverse))
        first, last = np.searchsorted(self.points, [begin, end])
        between = np.zeros((self.cameras, width, end - begin, 3))
        np.add.at(between, (self.index[first:last], slice(None), self.points[first:last] - begin), self.ap[first:last])
        flat = between.reshape(self.cameras * width, -1)
        times = np.einsum("apj,pjk->apk", flat.reshape(len(flat), -1, 3), inverse[begin:end])
        reduced -= times.reshape(len(flat), -1) @ flat.T
        right -= np.einsum("apk,pk->a", times, self.p[begin:end])


def adjust(problem, state, unknown):
    """The state of least residuals; `unknown` says what of it moves besides the points."""
    damping, residuals_px = 1e-4, problem.residuals_px(state)
    least = cost(residuals_px)
    for _ in range(STEPS):
        by_point = problem.by_point(state)
        of_camera, index, cameras = unknown.derivatives(problem, state, by_point)
        of_place = by_point @ state.turns[problem.frames]
        normal = Normal(problem, of_camera, of_place, residuals_px, cameras, index, len(state.places_m))
        before = least
        while damping < 1e6:
            steps, moved_m = normal.solved(damping, unknown.fixed)
            trial = unknown.moved(state, steps)._replace(places_m=state.places_m + moved_m)
            tried_px = problem.residuals_px(trial)
            if np.isfinite(tried_px).all() and cost(tried_px) <= least:
                state, residuals_px, least = trial, tried_px, cost(tried_px)
                damping = max(damping / 10, 1e-9)
                break
            damping *= 10
        if before - least < SETTLED * before:
            break
    return state


def adjust_twice(problem, state):
    """Adjusts poses, leaves out what is far off, and adjusts again; also the observations that were used."""
    state = adjust(problem, state, PosesUnknown())
    off_px = np.abs(problem.residuals_px(state)).max(axis=1)
    behind = problem.in_cameras(state)[:, 2] <= 0
    problem = problem.without((off_px > OUTLIER_PX) | behind)
    return problem, adjust(problem, state, PosesUnknown())
