"""Pictures and their table out of recordings of ROS by `tools/bag_pictures.py`: python3 -m unittest (in this folder).

Needs `rosbags`, `numpy`, `opencv-python-headless` and `pillow`. The program `uw` is taken from the folder UWGUIDE_PROGRAMS, else from target/release of
the repository.
"""

import csv
import io
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import cv2
import numpy as np
from PIL import Image
from rosbags import rosbag1
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

REPOSITORY = pathlib.Path(__file__).resolve().parents[4]
TOOL = REPOSITORY / "tools" / "bag_pictures.py"
PROGRAM = pathlib.Path(os.environ.get("UWGUIDE_PROGRAMS", REPOSITORY / "target" / "release")) / "uw"
LIMIT_S = 60
STORE = get_typestore(Stores.ROS2_HUMBLE)
T = STORE.types
START_S = 1_700_000_000


def header(time_s):
    sec, nanosec = divmod(round(1e9 * (START_S + time_s)), 10**9)
    return T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](sec, nanosec), "")


def range_at(time_s, value):
    return T["sensor_msgs/msg/Range"](header(time_s), 0, 0.1, 0.2, 10.0, value)


def number(value):
    return T["std_msgs/msg/Float64"](value)


def odometry(time_s, z):
    pose = T["geometry_msgs/msg/Pose"](T["geometry_msgs/msg/Point"](0.0, 0.0, z), T["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0))
    zero = T["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
    twist = T["geometry_msgs/msg/TwistWithCovariance"](T["geometry_msgs/msg/Twist"](zero, zero), np.zeros(36))
    return T["nav_msgs/msg/Odometry"](header(time_s), "base", T["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)), twist)


def colours(step):
    rows = np.zeros((6, 8, 3), np.uint8)
    rows[..., 0], rows[:, :4, 1], rows[..., 2] = step, 100, 7
    return rows


def compressed(time_s, step):
    file = io.BytesIO()
    Image.fromarray(colours(step)).save(file, "PNG")
    return T["sensor_msgs/msg/CompressedImage"](header(time_s), "png", np.frombuffer(file.getvalue(), np.uint8))


def raw(time_s, step):
    rows = np.pad(colours(step)[..., ::-1].reshape(6, -1), ((0, 0), (0, 5)), constant_values=99)
    return T["sensor_msgs/msg/Image"](header(time_s), 6, 8, "bgr8", 0, 29, rows.reshape(-1))


def info(width, k, d, model="plumb_bob", binning=0):
    of = T["sensor_msgs/msg/CameraInfo"], T["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    k = np.array(k, float)
    # Rectified pictures have twice the focal length, and another principal point.
    p = np.array([2 * k[0], 0, 3.5, 0, 0, 2 * k[4], 2.5, 0, 0, 0, 1, 0]) if k[0] else np.zeros(12)
    return of[0](header(0.0), 6, width, model, np.array(d, float), k, np.eye(3).ravel(), p, binning, binning, of[1])


class Bags(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def record(self, messages, storage=StoragePlugin.SQLITE3):
        """(s, topic, message), recorded a tenth of a second after they were made."""
        path = self.folder / "dive"
        with Writer(path, version=9, storage_plugin=storage) as writer:
            connections = {}
            for time_s, topic, message in messages:
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=STORE)
                data = STORE.serialize_cdr(message, message.__msgtype__)
                writer.write(connections[topic], round(1e9 * (START_S + time_s + 0.1)), data)
        return path

    def run_tool(self, path, *words, status=0):
        out = self.folder / "out"
        done = subprocess.run([sys.executable, TOOL, path, "-o", out, *words], capture_output=True, text=True, timeout=LIMIT_S)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        if status:
            self.assertFalse((out / "manifest.csv").exists())
            return done.stderr
        with (out / "manifest.csv").open() as file:
            rows = list(csv.DictReader(file))
        return rows, [np.asarray(Image.open(out / row["file"])) for row in rows], done.stderr

    def test_rows_have_what_was_known_at_the_pictures_time(self):
        dive = [(0.5 * k, "/range", range_at(0.5 * k, 1.0 + 0.1 * k)) for k in range(12)]
        dive += [(0.5 * k, "/depth", number(3.0 + 0.01 * k)) for k in range(12)]
        dive += [(0.5 * k, "/light_pct", number(40.0 if k < 6 else 80.0)) for k in range(12)]
        dive += [(0.25 + 0.5 * k, "/camera/image_raw/compressed", compressed(0.25 + 0.5 * k, k)) for k in range(10)]
        for storage in (StoragePlugin.SQLITE3, StoragePlugin.MCAP):
            with self.subTest(storage), tempfile.TemporaryDirectory() as folder:
                self.folder = pathlib.Path(folder)
                rows, pictures, _ = self.run_tool(self.record(sorted(dive, key=lambda one: one[0]), storage))
                # Two a second were taken, one a second is kept.
                self.assertEqual([picture[0, 0, 0] for picture in pictures], [0, 2, 4, 6, 8])
                self.assertTrue((pictures[2] == colours(4)).all())
                self.assertEqual([row["kind"] for row in rows], ["contrast"] * 5)
                np.testing.assert_allclose([float(row["distance_m"]) for row in rows], [1.05, 1.25, 1.45, 1.65, 1.85])
                # Depth and light have no stamp: they are as old as their recording, which came a tenth of a second late.
                np.testing.assert_allclose([float(row["depth_m"]) for row in rows], [3.003, 3.023, 3.043, 3.063, 3.083])
                self.assertEqual([float(row["light_pct"]) for row in rows], [40, 40, 40, 80, 80])

    def test_pixels_poses_and_fixed_lamps(self):
        dive = [(0.5 * k, "/odom", odometry(0.5 * k, -4.0)) for k in range(8)]
        dive += [(0.5 * k, "/range", range_at(0.5 * k, float("inf") if k == 4 else 2.0)) for k in range(8)]
        dive += [(0.5 * k, "/camera/image_raw", raw(0.5 * k, k)) for k in range(8)]
        words = "--image-topic /camera/image_raw --depth-topic /odom --light-pct 0 --every-s 0 --gap-s 0.3 --range-offset-m 0.25 --kind depth".split()
        rows, pictures, told = self.run_tool(self.record(sorted(dive, key=lambda one: one[0])), *words)
        # Without an echo there is no distance.
        self.assertEqual([picture[0, 0, 0] for picture in pictures], [0, 1, 2, 3, 5, 6, 7])
        self.assertTrue((pictures[1] == colours(1)).all())
        self.assertEqual(rows[0], {"file": "000001.png", "kind": "depth", "depth_m": "4", "distance_m": "2.25", "light_pct": "0"})
        self.assertIn("1 pictures left out: nothing of /range within 0.3 s", told)

    def test_pixels_of_every_encoding_make_the_same_colours(self):
        samples = {"r": 60, "g": 130, "b": 190}
        of_pixel = {"mono": "g", "rgb": "rgb", "bgr": "bgr", "rgba": "rgba", "bgra": "bgra"}
        pictures = {}
        for bits, scale in ((8, 1), (16, 250)):
            for name, order in of_pixel.items():
                pictures[f"{name}{bits}"] = np.array([[[scale * samples.get(c, 5) for c in order]] * 8] * 6)
            for pattern in ("rggb", "bggr", "grbg", "gbrg"):
                tile = np.array([scale * samples[c] for c in pattern]).reshape(2, 2)
                pictures[f"bayer_{pattern}{bits}"] = np.tile(tile, (3, 4))[..., None]
        yuv = cv2.cvtColor(np.full((6, 8, 3), list(samples.values()), np.uint8), cv2.COLOR_RGB2YUV_YUY2)
        pictures["yuyv"] = pictures["yuv422_yuy2"] = yuv
        pictures["uyvy"] = pictures["yuv422"] = yuv[..., ::-1]
        dive = [(0.0, "/range", range_at(0.0, 2.0)), (99.0, "/range", range_at(99.0, 2.0)), (0.0, "/depth", number(3.0)), (99.0, "/depth", number(3.0))]
        for k, (encoding, rows) in enumerate(pictures.items()):
            big = k % 2
            wide = rows.astype((">u2" if big else "<u2") if encoding.endswith("16") else np.uint8)
            data = np.frombuffer(wide.tobytes(), np.uint8)
            dive.append((k, "/image", T["sensor_msgs/msg/Image"](header(k), 6, 8, encoding, big, data.size // 6, data)))
        words = "--image-topic /image --light-pct 0 --gap-s 100".split()
        rows, _, _ = self.run_tool(self.record(sorted(dive, key=lambda one: one[0])), *words)
        self.assertEqual(len(rows), len(pictures))
        for row, encoding in zip(rows, pictures):
            found = cv2.imread(str(self.folder / "out" / row["file"]), cv2.IMREAD_UNCHANGED)
            expected = np.array([samples[c] for c in ("g" if "mono" in encoding else "bgr")])
            scale, allowed = (250 if encoding.endswith("16") else 1), (3 if "y" in encoding[:4] and "u" in encoding else 0)
            self.assertLessEqual(np.abs(found.reshape(48, -1) - scale * expected.astype(float)).max(), allowed, encoding)

    def test_the_cameras_calibration_is_written_for_the_programs(self):
        matrix = [6.5, 0, 3.8, 0, 6.4, 2.7, 0, 0, 1]
        rational = [0.62, 0.11, 0.0004, -0.0003, 0.006, 0.93, 0.21, 0.021]
        raw_matrix = np.reshape(matrix, (3, 3)).astype(float)
        rectified = np.array([[13.0, 0.0, 3.5], [0.0, 12.8, 2.5], [0.0, 0.0, 1.0]])
        for name, k, d, model in [
            ("image_raw", raw_matrix, np.array(rational), "rational_polynomial"),
            ("image_rect_color", rectified, np.zeros(5), "rational_polynomial"),
            ("image_rect", rectified, np.zeros(5), "equidistant"),
        ]:
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                self.folder = pathlib.Path(folder)
                dive = [(0.0, "/range", range_at(0.0, 1.0)), (0.0, "/depth", number(3.0))]
                dive += [(0.0, f"/cam/{name}/compressed", compressed(0.0, 1))]
                dive += [(0.0, "/cam/camera_info", info(8, matrix, rational, model))]
                words = f"--image-topic /cam/{name}/compressed --light-pct 0".split()
                self.run_tool(self.record(dive), *words)
                (self.folder / "points.csv").write_text("x_m,y_m,z_m\n1.0,-0.2,0.1\n")
                command = [PROGRAM, "project", self.folder / "out" / "camera.yaml", "--points", self.folder / "points.csv"]
                done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=True)
                row = next(csv.DictReader(done.stdout.splitlines()))
                zero = np.zeros(3)
                expected = cv2.projectPoints(np.array([[0.2, -0.1, 1.0]]), zero, zero, k, d)[0].ravel()
                np.testing.assert_allclose([float(row["px"]), float(row["py"])], expected + 0.5, atol=1e-6)

    def test_what_is_no_calibration_is_told(self):
        matrix = [6.5, 0, 3.8, 0, 6.4, 2.7, 0, 0, 1]
        for message, told in [
            (info(8, np.zeros(9), []), "was not calibrated (K is 0)"),
            (info(8, matrix, np.zeros(5), binning=2), "pictures that are binned"),
        ]:
            with tempfile.TemporaryDirectory() as folder:
                self.folder = pathlib.Path(folder)
                dive = [(0.0, "/range", range_at(0.0, 1.0)), (0.0, "/depth", number(3.0)), (0.0, "/image", raw(0.0, 1)), (0.0, "/camera_info", message)]
                words = [sys.executable, TOOL, self.record(dive), "-o", self.folder / "out", *"--image-topic /image --light-pct 0".split()]
                done = subprocess.run(words, capture_output=True, text=True, timeout=LIMIT_S, check=True)
                self.assertIn(told, done.stdout)
                self.assertFalse((self.folder / "out" / "camera.yaml").exists())

    def test_recordings_of_the_first_ros_are_read(self):
        store = get_typestore(Stores.ROS1_NOETIC)
        of = store.types
        with rosbag1.Writer(self.folder / "dive.bag") as writer:
            connections = {}

            def put(time_s, topic, message):
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=store)
                writer.write(connections[topic], round(1e9 * (START_S + time_s)), store.serialize_ros1(message, message.__msgtype__))

            for k in range(3):
                stamped = of["std_msgs/msg/Header"](k, of["builtin_interfaces/msg/Time"](START_S + k, 0), "")
                put(k, "/range", of["sensor_msgs/msg/Range"](stamped, 0, 0.1, 0.2, 10.0, 1.0 + k))
                put(k, "/depth", of["std_msgs/msg/Float32"](3.0))
                put(k, "/camera/image_raw", of["sensor_msgs/msg/Image"](stamped, 4, 4, "mono8", 0, 4, np.full(16, k, np.uint8)))
        words = ["--image-topic", "/camera/image_raw", "--light-pct", "0"]
        rows, pictures, _ = self.run_tool(self.folder / "dive.bag", *words)
        self.assertEqual([picture[0, 0] for picture in pictures], [0, 1, 2])
        self.assertEqual([(row["depth_m"], row["distance_m"]) for row in rows], [("3", "1"), ("3", "2"), ("3", "3")])

    def test_what_is_missing_is_told(self):
        dive = self.record([(0.0, "/range", range_at(0.0, 1.0)), (0.0, "/depth", number(3.0)), (0.0, "/camera/image_raw", raw(0.0, 1))])
        told = self.run_tool(dive, status=2)
        self.assertIn("--image-topic /camera/image_raw/compressed is not in the recording; there: /camera/image_raw (sensor_msgs/msg/Image)", told)
        pixels = ["--image-topic", "/camera/image_raw"]
        told = self.run_tool(dive, *pixels, status=2)
        self.assertIn("--light-topic /light_pct is not in the recording (--light-pct", told)
        told = self.run_tool(dive, *pixels, "--light-topic", "/range", status=2)
        self.assertIn("/range must be one of std_msgs/msg/Float64, std_msgs/msg/Float32, got sensor_msgs/msg/Range", told)
        self.assertIn("nowhere: is not there", self.run_tool(self.folder / "nowhere", status=2))
        for topic, words in [
            ("/camera_info", "--camera-info-topic /camera_info is not in the recording; there: /camera/image_raw"),
            ("/range", "/range must be one of sensor_msgs/msg/CameraInfo, got sensor_msgs/msg/Range"),
        ]:
            told = self.run_tool(dive, *pixels, "--light-pct", "100", "--camera-info-topic", topic, status=2)
            self.assertIn(words, told)
            self.assertFalse(list((self.folder / "out").iterdir()))
        rows, *_ = self.run_tool(dive, *pixels, "--light-pct", "100")
        self.assertEqual(len(rows), 1)
        short = raw(0.0, 1)
        short.data = short.data[:100]
        with tempfile.TemporaryDirectory() as folder:
            self.folder, kept = pathlib.Path(folder), self.folder
            cut = self.record([(0.0, "/range", range_at(0.0, 1.0)), (0.0, "/depth", number(3.0)), (0.0, "/camera/image_raw", short)])
            told = self.run_tool(cut, *pixels, "--light-pct", "0", status=2)
            self.assertIn("a picture of 8 x 6 bgr8 needs steps of 24 bytes and 174 in all, got 29 and 100", told)
            self.folder = kept
        # Nothing is written over.
        done = subprocess.run([sys.executable, TOOL, dive, "-o", self.folder / "out"], capture_output=True, text=True, timeout=LIMIT_S)
        self.assertEqual(done.returncode, 2)
        self.assertIn("has a manifest.csv already", done.stderr)


if __name__ == "__main__":
    unittest.main()
