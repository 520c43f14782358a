"""What a folder of `uw sequence --stereo` says: pictures, camera, and apart from them the true poses."""

import json

import cv2
import numpy as np


class Refused(Exception):
    """What cannot be reconstructed, in a sentence for who asked."""


class Rig:
    """Two equal pinholes side by side; image points are counted from the middle of the first pixel, as OpenCV's."""

    def __init__(self, matrix, baseline_m, size_px):
        self.matrix, self.baseline_m, self.size_px = np.array(matrix, float).reshape(3, 3), float(baseline_m), size_px

    @property
    def numbers(self):
        """fx, fy, cx, cy in pixels, baseline in m."""
        m = self.matrix
        return np.array([m[0, 0], m[1, 1], m[0, 2], m[1, 2], self.baseline_m])


def read_rig(folder):
    """What `camera.json` says."""
    path = folder / "camera.json"
    try:
        told = json.loads(path.read_text())
        model, port, baseline_m = told["model"], told["port"], told["stereo_baseline_m"]
        if model != "pinhole" or port is not None:
            raise Refused(f"{path}: a pinhole without a port is needed, got {model}{' behind a port' if port else ''}")
        if not baseline_m:
            raise Refused(f"{path}: has no stereo_baseline_m; render with --stereo BASELINE_M")
        return Rig(told["opencv"]["camera_matrix"], baseline_m, (told["width"], told["height"]))
    except OSError as error:
        raise Refused(f"{path}: cannot be read ({error.strerror}); a folder that `uw sequence --stereo` has finished is needed") from error
    except (ValueError, KeyError, TypeError) as error:
        raise Refused(f"{path}: is no camera of `uw sequence` ({error!r})") from error


def read_rows(path, columns):
    """Lines of a list in the way of the TUM RGB-D data sets, without comments."""
    try:
        lines = [line.split() for line in path.read_text().splitlines() if line.strip() and not line.startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        raise Refused(f"{path}: cannot be read ({getattr(error, 'strerror', error)}); a folder that `uw sequence --stereo` has finished is needed") from error
    if not lines or any(len(line) != columns for line in lines):
        raise Refused(f"{path}: must hold lines of {columns} words")
    return lines


def picture_files(folder):
    """Times, s, and files of the left and of the right eye."""
    left, right = (read_rows(folder / name, 2) for name in ("rgb.txt", "rgb_right.txt"))
    if [time for time, _ in left] != [time for time, _ in right]:
        raise Refused(f"{folder}: rgb.txt and rgb_right.txt are not of the same times")
    return [time for time, _ in left], [folder / name for _, name in left], [folder / name for _, name in right]


def read_grey(path, size_px, mirrored):
    """A picture in grey, its local contrast evened, so that dark corners have features too."""
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if grey is None:
        raise Refused(f"{path}: is no picture that can be read")
    if grey.shape != size_px[::-1]:
        raise Refused(f"{path}: has {grey.shape[1]} x {grey.shape[0]} pixels, camera.json {size_px[0]} x {size_px[1]}")
    grey = cv2.flip(grey, 1) if mirrored else grey
    return cv2.createCLAHE(clipLimit=3.0, tileGridSize=(8, 8)).apply(grey)


def read_truth(folder, times):
    """`groundtruth.txt`: positions, m, and rotations from camera to world, one for each picture."""
    path = folder / "groundtruth.txt"
    rows = read_rows(path, 8)
    if [row[0] for row in rows] != times:
        raise Refused(f"{path}: its times are not those of rgb.txt")
    try:
        numbers = np.array(rows, float)
    except ValueError as error:
        raise Refused(f"{path}: {error}") from error
    lengths = np.linalg.norm(numbers[:, 4:], axis=1)
    if not (np.isfinite(numbers).all() and np.allclose(lengths, 1, atol=1e-3)):
        raise Refused(f"{path}: must hold finite positions and quaternions of length 1")
    if not np.ptp(numbers[:, 1:4], axis=0).any():
        raise Refused(f"{path}: the camera does not move, so there is no track to compare")
    return numbers[:, 1:4], np.array([rotation_of(quaternion) for quaternion in numbers[:, 4:]])


def rotation_of(quaternion):
    """The matrix of a quaternion x, y, z, w."""
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
