"""From pictures to first poses and tracks: features, matches between the eyes and from frame to frame, poses by PnP."""

import cv2
import numpy as np

from .pictures import Refused, read_grey

FEATURES = 1500
# A match's descriptors are nearer to each other than to the second best by this factor, and mutually the nearest.
RATIO = 0.8
# The rows of a point in the two eyes are the same; features are found to about 0.3 px.
ROW_TOLERANCE_PX = 1.5
# Farther than that many baselines a disparity says too little.
FARTHEST_BASELINES = 60
# How far a feature may move from frame to frame, of the picture's width.
MOTION_SHARE = 0.2
PNP_TOLERANCE_PX = 2.0
LEAST_MATCHES = 12


class Frame:
    """Features of the left picture; `right_px` is the column in the right one, NaN where it is not known."""

    def __init__(self, points_px, right_px, descriptors):
        self.points_px, self.right_px, self.descriptors = points_px, right_px, descriptors
        self.points_m = None


def features(path, rig, detector, mirrored):
    """Image points and descriptors of length 1."""
    found, descriptors = detector.detectAndCompute(read_grey(path, rig.size_px, mirrored), None)
    if descriptors is None:
        raise Refused(f"{path}: no features are found")
    return np.array([point.pt for point in found]), descriptors / np.maximum(np.linalg.norm(descriptors, axis=1, keepdims=True), 1e-9)


def mutual_matches(ours, theirs, possible):
    """Pairs of indices whose descriptors are mutually the nearest among those possible, and clearly so."""
    if not len(ours) or not len(theirs):
        return np.zeros((0, 2), int)
    distance = np.sqrt(np.maximum(2 - 2 * ours @ theirs.T, 0))
    distance[~possible] = np.inf
    rows = np.arange(len(ours))
    best = distance.argmin(axis=1)
    least = distance[rows, best]
    distance[rows, best] = np.inf
    second = distance.min(axis=1)
    distance[rows, best] = least
    mutual = distance.argmin(axis=0)[best] == rows
    good = np.isfinite(least) & (least < RATIO * second) & mutual
    return np.stack([rows[good], best[good]], axis=1)


def see(left, right, rig, detector, mirrored):
    """A frame with the places of its points, m, in the left camera."""
    (points_px, descriptors), (others_px, others) = (features(path, rig, detector, mirrored) for path in (left, right))
    disparity_px = points_px[:, None, 0] - others_px[None, :, 0]
    rows_px = points_px[:, None, 1] - others_px[None, :, 1]
    possible = (np.abs(rows_px) < ROW_TOLERANCE_PX) & (disparity_px > rig.matrix[0, 0] / FARTHEST_BASELINES)
    right_px = np.full(len(points_px), np.nan)
    pairs = mutual_matches(descriptors, others, possible)
    right_px[pairs[:, 0]] = others_px[pairs[:, 1], 0]
    frame = Frame(points_px, right_px, descriptors)
    frame.points_m = triangulated(points_px, right_px, rig)
    return frame


def triangulated(points_px, right_px, rig):
    """Points in the left camera from both eyes, m."""
    fx, fy, cx, cy, baseline_m = rig.numbers
    depth_m = fx * baseline_m / (points_px[:, 0] - right_px)
    x, y = (points_px[:, 0] - cx) / fx, (points_px[:, 1] - cy) / fy
    return np.stack([x, y, np.ones_like(x)], axis=1) * depth_m[:, None]


def follow(before, frame, rig, k):
    """Matches from the frame before that agree with one motion, and that motion: points of before into this camera."""
    known = np.flatnonzero(np.isfinite(before.right_px))
    moved_px = np.linalg.norm(before.points_px[known, None] - frame.points_px[None], axis=2)
    pairs = mutual_matches(before.descriptors[known], frame.descriptors, moved_px < MOTION_SHARE * rig.size_px[0])
    pairs[:, 0] = known[pairs[:, 0]]
    few = f"frame {k}: {{}} matches with the one before, at least {LEAST_MATCHES} are needed; more light, clearer water or smaller steps help"
    if len(pairs) < LEAST_MATCHES:
        raise Refused(few.format(len(pairs)))
    found, turn, shift, inliers = cv2.solvePnPRansac(
        before.points_m[pairs[:, 0]],
        frame.points_px[pairs[:, 1]],
        rig.matrix,
        None,
        iterationsCount=1000,
        reprojectionError=PNP_TOLERANCE_PX,
        confidence=0.9999,
        flags=cv2.SOLVEPNP_SQPNP,
    )
    if not found or inliers is None or len(inliers) < LEAST_MATCHES:
        raise Refused(few.format(0 if inliers is None else len(inliers)))
    return pairs[inliers[:, 0]], cv2.Rodrigues(turn)[0], shift[:, 0]


class Tracks:
    """Observations: frame, point, and image coordinates (left column, row, right column, NaN where unknown)."""

    def __init__(self):
        self.frames, self.points, self.seen_px = [], [], []
        self.places_m = []

    def add(self, k, point, frame, feature):
        self.frames.append(k)
        self.points.append(point)
        self.seen_px.append([*frame.points_px[feature], frame.right_px[feature]])


def run(left_files, right_files, rig, mirrored, tell):
    """Rotations and shifts from the first camera to each, and tracks with places in the first camera."""
    cv2.setRNGSeed(0)
    # Without the precise upscale OpenCV's points are a quarter of a pixel off.
    detector = cv2.SIFT_create(nfeatures=FEATURES, contrastThreshold=0.02, enable_precise_upscale=True)
    turns, shifts_m, tracks = [np.eye(3)], [np.zeros(3)], Tracks()
    before, points_of = None, {}
    for k, (left, right) in enumerate(zip(left_files, right_files)):
        frame = see(left, right, rig, detector, mirrored)
        if before is not None:
            pairs, turn, shift_m = follow(before, frame, rig, k)
            to_world = turns[-1].T
            now = {}
            for old, new in pairs:
                point = points_of.get(old)
                if point is None:
                    point = len(tracks.places_m)
                    tracks.places_m.append(to_world @ (before.points_m[old] - shifts_m[-1]))
                    tracks.add(k - 1, point, before, old)
                tracks.add(k, point, frame, new)
                now[new] = point
            points_of = now
            turns.append(turn @ turns[-1])
            shifts_m.append(turn @ shifts_m[-1] + shift_m)
            tell(k, len(pairs))
        before = frame
    return np.array(turns), np.array(shifts_m), tracks
