"""Sequences of `uw sequence --format mcap` read by the packages `mcap` and `rosbags` of PyPI: python3 -m unittest (in this folder).

Needs `mcap`, `rosbags`, `numpy` and `pillow`. The program is taken from the folder UWGUIDE_PROGRAMS, else from target/release of the repository.
"""

import io
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
from mcap.reader import make_reader
from PIL import Image
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

REPOSITORY = pathlib.Path(__file__).resolve().parents[4]
PROGRAM = pathlib.Path(os.environ.get("UWGUIDE_PROGRAMS", REPOSITORY / "target" / "release")) / "uw"
LIMIT_S = 300
POSES = "100.25 0 -0.2 -3 0.5 -0.5 0.5 -0.5\n101.5 0.1 0.3 -3 0.5 -0.5 0.5 -0.5\n"
TOPICS = ["/left/camera_info", "/left/depth", "/left/image/compressed", "/pose", "/right/camera_info", "/right/depth", "/right/image/compressed", "/tf"]


class Sequences(unittest.TestCase):
    """One stereo sequence of two frames."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        root = pathlib.Path(cls.folder.name)
        (root / "poses.txt").write_text(POSES)
        words = "sequence flat_hull poses.txt -o hull --stereo 0.12 --width 64 --spp 2 --format mcap -q".split()
        subprocess.run([PROGRAM, *words], cwd=root, timeout=LIMIT_S, check=True)
        cls.root = root / "hull"
        cls.store = get_typestore(Stores.ROS2_HUMBLE)
        with (cls.root / "sequence.mcap").open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            cls.profile = reader.get_header().profile
            cls.read = [(schema, channel, message) for schema, channel, message in reader.iter_messages()]

    def of(self, topic):
        """The messages of a topic, decoded by rosbags."""
        found = [(s.name, m) for s, c, m in self.read if c.topic == topic]
        return [(self.store.deserialize_cdr(m.data, name), m) for name, m in found]

    def test_topics_and_definitions(self):
        self.assertEqual(self.profile, "ros2")
        self.assertEqual(sorted({channel.topic for _, channel, _ in self.read}), TOPICS)
        self.assertEqual({channel.message_encoding for _, channel, _ in self.read}, {"cdr"})
        for schema in {schema.name: schema for schema, _, _ in self.read}.values():
            self.assertEqual(schema.encoding, "ros2msg")
            types = get_types_from_msg(schema.data.decode(), schema.name)
            own = self.store.get_msgdef(schema.name)
            # Those of the file are the system's own: the same fields in the same order.
            self.assertEqual([field for field, _ in types[schema.name][1]], [field for field, _ in own.fields], schema.name)

    def test_pictures_are_those_of_the_folder(self):
        for side, kind in (("left", "rgb"), ("right", "rgb_right")):
            messages = self.of(f"/{side}/image/compressed")
            self.assertEqual(len(messages), 2)
            for k, (picture, raw) in enumerate(messages):
                self.assertEqual(bytes(picture.data), (self.root / kind / f"{k:06}.png").read_bytes())
                self.assertEqual((picture.format, picture.header.frame_id), ("png", f"{side}_optical"))
                self.assertEqual(raw.sequence, k)
        stamps = [(m.header.stamp.sec, m.header.stamp.nanosec) for m, _ in self.of("/left/image/compressed")]
        self.assertEqual(stamps, [(100, 250_000_000), (101, 500_000_000)])

    def test_depth_is_that_of_the_folder(self):
        for side, kind in (("left", "depth"), ("right", "depth_right")):
            for k, (depth, _) in enumerate(self.of(f"/{side}/depth")):
                stored = np.array(Image.open(io.BytesIO((self.root / kind / f"{k:06}.png").read_bytes())))
                self.assertEqual((depth.encoding, depth.is_bigendian, depth.step), ("16UC1", 0, 128))
                values = np.frombuffer(bytes(depth.data), "<u2").reshape(depth.height, depth.width)
                np.testing.assert_array_equal(values, stored)

    def test_poses_cameras_and_frames(self):
        poses = [m.pose for m, _ in self.of("/pose")]
        self.assertEqual([(p.position.x, p.position.y, p.position.z) for p in poses], [(0, -0.2, -3), (0.1, 0.3, -3)])
        turn = poses[1].orientation
        np.testing.assert_allclose([turn.x, turn.y, turn.z, turn.w], [0.5, -0.5, 0.5, -0.5], atol=1e-12)
        left, right = (self.of(f"/{side}/camera_info")[0][0] for side in ("left", "right"))
        self.assertEqual((left.width, left.height, left.distortion_model), (64, 36, "plumb_bob"))
        # The middle of a picture of 64 pixels is 31.5 where the first has its own at 0.
        self.assertAlmostEqual(left.k[2], 31.5)
        self.assertAlmostEqual(right.p[3], -0.12 * right.k[0])
        world, eyes = self.of("/tf")[1][0].transforms
        self.assertEqual((world.header.frame_id, world.child_frame_id), ("world", "left_optical"))
        self.assertEqual((eyes.header.frame_id, eyes.child_frame_id), ("left_optical", "right_optical"))
        self.assertEqual(world.transform.translation.y, 0.3)
        self.assertEqual(eyes.transform.translation.x, 0.12)


if __name__ == "__main__":
    unittest.main()
