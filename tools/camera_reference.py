"""Makes the reference image points of the camera's tests: OpenCV's projections, and AquaCal's through a flat interface.

    pip install opencv-python-headless aquacal
    python tools/camera_reference.py crates/render/tests/data

`opencv_projection.csv` holds `cv2.projectPoints` (Brown-Conrady) and `cv2.fisheye.projectPoints` (Kannala and Brandt),
`aquacal_flat_port.csv` holds `aquacal.core.refractive_geometry.refractive_project_batch`: a camera in air before water, without
glass. Points are in the camera's frame (right, down, forward).
"""

import csv
import importlib.metadata
import pathlib
import sys

import cv2
import numpy as np
from aquacal.config.schema import CameraExtrinsics, CameraIntrinsics
from aquacal.core.camera import Camera
from aquacal.core.interface_model import Interface
from aquacal.core.refractive_geometry import refractive_project_batch

SEED = 32
POINTS = 40
LENS = {"fx": 612.5, "fy": 608.25, "cx": 641.3, "cy": 355.8}
# k1, k2, p1, p2, k3
PERSPECTIVE = [
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [-0.28, 0.11, 0.001, -0.0007, -0.02],
    [0.12, -0.03, -0.002, 0.0015, 0.004],
]
# and k4, k5, k6
RATIONAL = [0.62, 0.11, 0.0004, -0.0003, 0.006, 0.93, 0.21, 0.021]
# k1, k2, k3, k4
FISHEYE = [
    [0.0, 0.0, 0.0, 0.0],
    [-0.021, 0.0037, -0.0012, 0.0003],
    [0.06, -0.012, 0.002, -0.0001],
]
WATER_INDEX = 1.34
DISTANCES_M = [0.005, 0.02, 0.12]
RANGES_M = [0.3, 1.0, 3.0, 10.0]


def matrix():
    return np.array([[LENS["fx"], 0, LENS["cx"]], [0, LENS["fy"], LENS["cy"]], [0, 0, 1.0]])


def points_within(random, half_angle_deg, ranges_m):
    """Points in all directions up to an angle off the axis, at given distances along it."""
    angle = np.radians(random.uniform(0, half_angle_deg, POINTS))
    azimuth = random.uniform(0, 2 * np.pi, POINTS)
    z = np.resize(ranges_m, POINTS)
    radius = z * np.tan(angle)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=1)


def opencv_rows(random):
    still = np.zeros(3)
    for k in PERSPECTIVE:
        points = points_within(random, 45.0, RANGES_M)
        seen, _ = cv2.projectPoints(points, still, still, matrix(), np.array(k))
        yield from rows("perspective", [*k, 0.0, 0.0, 0.0], points, seen)
    more = np.random.default_rng(SEED + 1)
    points = np.concatenate([points_within(more, 45.0, RANGES_M) for _ in PERSPECTIVE])
    seen, _ = cv2.projectPoints(points, still, still, matrix(), np.array(RATIONAL))
    yield from rows("rational", RATIONAL, points, seen)
    for k in FISHEYE:
        points = points_within(random, 85.0, RANGES_M)
        seen, _ = cv2.fisheye.projectPoints(points[:, None], still, still, matrix(), np.array(k))
        yield from rows("fisheye", [*k, 0.0, 0.0, 0.0, 0.0], points, seen)


def rows(model, k, points, seen):
    for point, pixel in zip(points, seen.reshape(-1, 2)):
        yield [model, *LENS.values(), *k, *point, *pixel]


def aquacal_rows(random):
    for distance_m in DISTANCES_M:
        camera = Camera(
            "camera",
            CameraIntrinsics(matrix(), np.zeros(5), (1280, 720)),
            CameraExtrinsics(np.eye(3), np.zeros(3)),
        )
        interface = Interface(np.array([0, 0, -1.0]), {"camera": distance_m}, 1.0, WATER_INDEX)
        points = points_within(random, 35.0, RANGES_M)
        for point, pixel in zip(points, refractive_project_batch(camera, interface, points)):
            yield [*LENS.values(), distance_m, WATER_INDEX, *point, *pixel]


def write(path, source, header, table):
    with open(path, "w", newline="") as file:
        file.write(f"# {source}; made by tools/camera_reference.py\n")
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([[v if isinstance(v, str) else f"{v:.12g}" for v in row] for row in table])


def main(folder):
    random = np.random.default_rng(SEED)
    lens = list(LENS)
    place = ["x_m", "y_m", "z_m", "px", "py"]
    write(
        folder / "opencv_projection.csv",
        f"OpenCV {cv2.__version__}, cv2.projectPoints (d: k1 k2 p1 p2 k3 k4 k5 k6) and cv2.fisheye.projectPoints (d: k1 k2 k3 k4)",
        ["model", *lens, *(f"d{i}" for i in range(8)), *place],
        opencv_rows(random),
    )
    write(
        folder / "aquacal_flat_port.csv",
        f"AquaCal {importlib.metadata.version('aquacal')}, refractive_project_batch",
        [*lens, "distance_m", "water_index", *place],
        aquacal_rows(random),
    )


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
