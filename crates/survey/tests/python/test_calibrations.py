"""Calibrations of OpenCV and Metashape, read by `uw project`: python3 -m unittest (in this folder).

Needs `numpy` and `opencv-python-headless`. The program is taken from the folder UWGUIDE_PROGRAMS, else from target/release of the repository.
"""

import csv
import os
import pathlib
import subprocess
import tempfile
import unittest

import cv2
import numpy as np

REPOSITORY = pathlib.Path(__file__).resolve().parents[4]
PROGRAM = pathlib.Path(os.environ.get("UWGUIDE_PROGRAMS", REPOSITORY / "target" / "release")) / "uw"
LIMIT_S = 60
MATRIX = np.array([[612.5, 0.0, 641.3], [0.0, 608.25, 355.8], [0.0, 0.0, 1.0]])
COEFFICIENTS = np.array([-0.12, 0.03, 0.001, -0.0007, -0.002])
RATIONAL = np.array([0.62, 0.11, 0.0004, -0.0003, 0.006, 0.93, 0.21, 0.021])
FISHEYE = np.array([-0.021, 0.0037, -0.0012, 0.0003])
# Right, down and ahead of the camera, m.
POINTS = np.random.default_rng(5).uniform([-0.8, -0.5, 1.0], [0.8, 0.5, 1.2], (40, 3))


class Calibrations(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, coefficients, ending="yaml", **more):
        """As OpenCV's own calibration does."""
        file = self.folder / f"camera.{ending}"
        storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
        storage.write("calibration_time", "today")
        storage.write("image_width", 1280)
        storage.write("image_height", 720)
        for name, value in more.items():
            storage.write(name, value)
        storage.write("camera_matrix", MATRIX)
        storage.write("distortion_coefficients", coefficients)
        storage.release()
        return file

    def project(self, camera):
        """Image points, from the upper left corner of the picture. The camera of a calibration looks along x, with z up."""
        rows = [{"x_m": ahead, "y_m": -right, "z_m": -down} for right, down, ahead in POINTS]
        with (self.folder / "points.csv").open("w", newline="") as file:
            table = csv.DictWriter(file, rows[0])
            table.writeheader()
            table.writerows(rows)
        command = [PROGRAM, "project", camera, "--points", self.folder / "points.csv"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=True)
        return np.array([[float(row["px"]), float(row["py"])] for row in csv.DictReader(done.stdout.splitlines())])

    def test_points_are_where_opencv_projects_them(self):
        zero = np.zeros(3)
        for coefficients in (COEFFICIENTS, RATIONAL, np.append(RATIONAL, np.zeros(6)), np.zeros(5)):
            expected = cv2.projectPoints(POINTS, zero, zero, MATRIX, coefficients)[0][:, 0]
            for ending in ("yaml", "xml"):
                found = self.project(self.write(coefficients, ending))
                # OpenCV counts from the middle of the first pixel.
                self.assertLess(np.abs(found - 0.5 - expected).max(), 1e-6)

    def test_points_of_a_fisheye_too(self):
        zero = np.zeros(3)
        expected = cv2.fisheye.projectPoints(POINTS[:, None], zero, zero, MATRIX, FISHEYE)[0][:, 0]
        found = self.project(self.write(FISHEYE, distortion_model="equidistant"))
        self.assertLess(np.abs(found - 0.5 - expected).max(), 1e-6)

    def test_points_are_where_metashape_has_them(self):
        """By the formulas of its manual, appendix "Camera models"."""
        f, cx, cy, b1 = 611.25, 4.5, -7.25, 1.5
        k1, k2, k3, p1, p2 = -0.12, 0.03, -0.002, 0.001, -0.0007
        numbers = {"f": f, "cx": cx, "cy": cy, "b1": b1, "k1": k1, "k2": k2, "k3": k3, "p1": p1, "p2": p2}
        written = "".join(f"<{name}>{value}</{name}>" for name, value in numbers.items())
        x, y = POINTS[:, 0] / POINTS[:, 2], POINTS[:, 1] / POINTS[:, 2]
        r2 = x * x + y * y
        radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
        across = x * radial + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y
        down = y * radial + p2 * (r2 + 2 * y * y) + 2 * p1 * x * y
        expected = np.column_stack([640 + cx + across * (f + b1), 360 + cy + down * f])
        head = "<projection>frame</projection><width>1280</width><height>720</height>"
        alone = f"<calibration>{head}{written}</calibration>"
        inside = f'<calibration type="frame" class="adjusted"><resolution width="1280" height="720"/>{written}</calibration>'
        exported = f'<document version="2.0.0"><chunk><sensors><sensor id="0">{inside}</sensor></sensors></chunk></document>'
        file = self.folder / "camera.xml"
        for text in (alone, exported):
            file.write_text('<?xml version="1.0" encoding="UTF-8"?>\n' + text)
            self.assertLess(np.abs(self.project(file) - expected).max(), 1e-6)

    def test_models_that_are_not_known_are_told(self):
        file = self.write(np.append(RATIONAL, [0.1, 0.0, 0.0, 0.0]))
        command = [PROGRAM, "project", file, "--points", "-"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, input="x_m,y_m,z_m\n1,0,0\n")
        self.assertEqual(done.returncode, 2)
        self.assertIn("distortion_coefficients.data must be k1, k2, p1, p2, k3, k4, k5, k6 and nothing beyond but zeros", done.stderr)


if __name__ == "__main__":
    unittest.main()
