"""`uwguide --ros2` beside another node, whose DDS is Eclipse Cyclone and not the program's own: python3 -m unittest (in this folder).

Needs `cyclonedds`, `rosbags`, `opencv-python-headless` and `pillow` of PyPI, and a program built with the feature `ros2`; it is taken from the folder UWGUIDE_PROGRAMS,
else from target/release of the repository. What the node publishes is decoded by `rosbags` from its `.msg` file, what it reads is
encoded by it.
"""

import functools
import io
import json
import math
import os
import pathlib
import random
import subprocess
import tempfile
import time
import unittest

import cv2
import numpy
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct, annotations, types
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from dataclasses import dataclass
from PIL import Image
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

REPOSITORY = pathlib.Path(__file__).resolve().parents[4]
PROGRAM = pathlib.Path(os.environ.get("UWGUIDE_PROGRAMS", REPOSITORY / "target" / "release")) / "uwguide"
MESSAGE = REPOSITORY / "ros2" / "uwguide_msgs" / "msg" / "Suggestion.msg"
LIMIT_S = 30

# Any picture is answered: what is tested here is the way there and back.
CONFIG = """
format = "uwguide-config/1"
[checks]
training = "ignore"
misfit = "ignore"
[images]
directory = "%s"
[ros2]
silence_s = 2.0
range_offset_m = 0.25
depth_type = "%s"
%s
"""


def store(release):
    """Message types of a release of ROS 2 and the program's own."""
    types_of = get_typestore(release)
    types_of.register(get_types_from_msg(MESSAGE.read_text(), "uwguide_msgs/msg/Suggestion"))
    return types_of


JAZZY = store(Stores.ROS2_JAZZY)


@functools.cache
def pixels():
    """A picture of the shipped model's camera with detail and noise: rows, columns, R G B."""
    numbers = random.Random(7)
    waves = [[12 * math.sin(0.2 * x) * math.cos(0.25 * y) for x in range(1280)] for y in range(720)]
    counts = bytes(
        min(255, max(0, round(level + wave + numbers.gauss(0, 2)))) for row in waves for wave in row for level in (40, 80, 70)
    )
    return numpy.frombuffer(counts, numpy.uint8).reshape(720, 1280, 3)


def png(rows):
    file = io.BytesIO()
    Image.fromarray(rows).save(file, "PNG")
    return file.getvalue()


def picture():
    """The same as PNG."""
    return png(pixels())


# The types as DDS names them. Cyclone has them with their fields one after the other; the bytes are the same as those of nested messages.


@dataclass
@annotations.final
class Float64(IdlStruct, typename="std_msgs::msg::dds_::Float64_"):
    data: types.float64


@dataclass
@annotations.final
class Float32(IdlStruct, typename="std_msgs::msg::dds_::Float32_"):
    data: types.float32


@dataclass
@annotations.final
class Range(IdlStruct, typename="sensor_msgs::msg::dds_::Range_"):
    sec: types.int32
    nanosec: types.uint32
    frame_id: str
    radiation_type: types.uint8
    field_of_view: types.float32
    min_range: types.float32
    max_range: types.float32
    range: types.float32
    variance: types.float32


@dataclass
@annotations.final
class FluidPressure(IdlStruct, typename="sensor_msgs::msg::dds_::FluidPressure_"):
    sec: types.int32
    nanosec: types.uint32
    frame_id: str
    fluid_pressure: types.float64
    variance: types.float64


Covariance = types.array[types.float64, 36]


@dataclass
@annotations.final
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    sec: types.int32
    nanosec: types.uint32
    frame_id: str
    position: types.array[types.float64, 3]
    orientation: types.array[types.float64, 4]


@dataclass
@annotations.final
class PoseWithCovarianceStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovarianceStamped_"):
    sec: types.int32
    nanosec: types.uint32
    frame_id: str
    position: types.array[types.float64, 3]
    orientation: types.array[types.float64, 4]
    covariance: Covariance


@dataclass
@annotations.final
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    sec: types.int32
    nanosec: types.uint32
    frame_id: str
    child_frame_id: str
    position: types.array[types.float64, 3]
    orientation: types.array[types.float64, 4]
    covariance: Covariance
    twist: types.array[types.float64, 6]
    twist_covariance: Covariance


@dataclass
@annotations.final
class CompressedImage(IdlStruct, typename="sensor_msgs::msg::dds_::CompressedImage_"):
    sec: types.int32
    nanosec: types.uint32
    frame_id: str
    format: str
    data: types.sequence[types.uint8]


@dataclass
@annotations.final
class RawImage(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    sec: types.int32
    nanosec: types.uint32
    frame_id: str
    height: types.uint32
    width: types.uint32
    encoding: str
    is_bigendian: types.uint8
    step: types.uint32
    data: types.sequence[types.uint8]


Three = types.array[types.float64, 3]


@dataclass
@annotations.final
class Suggestion(IdlStruct, typename="uwguide_msgs::msg::dds_::Suggestion_"):
    sec: types.int32
    nanosec: types.uint32
    frame_id: str
    valid: bool
    action: str
    reason: str
    message: str
    why: str
    warnings: types.sequence[str]
    distance_m: types.float64
    light_pct: types.float64
    level_pct: types.float64
    delta_distance_m: types.float64
    delta_light_pct: types.float64
    x: types.float64
    y: types.float64
    z: types.float64
    predicted_contrast: Three
    predicted_contrast_error: Three
    predicted_here: Three
    predicted_here_error: Three
    residual_here: Three
    residual_misfit: types.float64
    score: types.float64
    score_here: types.float64
    gain: types.float64
    predictor: str

    @classmethod
    def deserialize(cls, data, *arguments, **named):
        """Keeps the bytes as they came, for another decoder."""
        made = super().deserialize(data, *arguments, **named)
        made.raw = bytes(data)
        return made


def qos(reliability):
    """Of a topic, with the encoding that ROS 2 has."""
    encoding = Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False)
    return Qos(reliability, Policy.History.KeepLast(10), encoding)


RELIABLE = Policy.Reliability.Reliable(10**9)


class Peer:
    """Another node: sensors of a vehicle, and someone who listens."""

    def __init__(
        self,
        domain_id,
        sensors=Policy.Reliability.BestEffort,
        image=("rt/camera/image_raw/compressed", CompressedImage),
        distance=Range,
        light=Float64,
    ):
        self.participant = DomainParticipant(domain_id)
        self.range = self.writer("rt/range", distance, sensors)
        self.light = self.writer("rt/light_pct", light, sensors)
        self.image = self.writer(*image, sensors)
        topic = Topic(self.participant, "rt/uwguide/suggestion", Suggestion)
        self.suggestions = DataReader(self.participant, topic, qos=qos(RELIABLE))

    def writer(self, name, kind, reliability):
        return DataWriter(self.participant, Topic(self.participant, name, kind), qos=qos(reliability))

    def depth(self, kind):
        return self.writer("rt/depth", kind, Policy.Reliability.BestEffort)

    def wait(self, *writers):
        """Until the program listens to all, and speaks."""
        end = time.monotonic() + LIMIT_S
        while time.monotonic() < end:
            heard = all(writer.get_matched_subscriptions() for writer in writers)
            if heard and self.suggestions.get_matched_publications():
                return
            time.sleep(0.02)
        raise AssertionError(f"no node was found within {LIMIT_S} s")

    def next(self, wanted=lambda _: True, limit_s=LIMIT_S):
        """The next suggestion that is wanted."""
        end = time.monotonic() + limit_s
        while time.monotonic() < end:
            for made in self.suggestions.take(N=1):
                if wanted(made):
                    return made
            time.sleep(0.005)
        raise AssertionError(f"no such suggestion came within {limit_s} s")


class Program:
    """`uwguide --ros2` in a domain of its own."""

    def __init__(self, folder, depth_type="std_msgs/msg/Float64", settings="", more=()):
        self.config = pathlib.Path(folder) / "uwguide.toml"
        self.config.write_text(CONFIG % (folder, depth_type, settings))
        self.domain_id = random.randrange(20, 200)
        self.arguments = ["--profile", "1C", "--config", self.config]
        self.log = (pathlib.Path(folder) / "log").open("w+b")
        command = [PROGRAM, *self.arguments, "--ros2", "--listen", "127.0.0.1:0", *more]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(self.domain_id)}
        self.process = subprocess.Popen(command, stderr=self.log, env=environment)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.code = self.process.wait(LIMIT_S)
        self.log.close()

    def answer_to(self, data, depth_m=3.0):
        """What the protocol says to the file of a picture."""
        (self.config.parent / "now.png").write_bytes(data)
        there = {"depth_m": depth_m, "distance_m": 1.0, "light_pct": 20.0}
        return self.answer({"op": "suggest_image", **there, "image": {"path": "now.png"}})

    def answer(self, request):
        """What the protocol says to the same."""
        lines = json.dumps(request).encode() + b"\n"
        done = subprocess.run([PROGRAM, *self.arguments, "--stdio"], input=lines, capture_output=True, timeout=LIMIT_S, check=True)
        return json.loads(done.stdout)

    def logged(self, wanted):
        """A line of the log with these words, as soon as there is one."""
        end = time.monotonic() + LIMIT_S
        while time.monotonic() < end:
            for line in pathlib.Path(self.log.name).read_text().splitlines():
                if all(word in line for word in wanted):
                    return line
            time.sleep(0.05)
        raise AssertionError(f"no line with {wanted} within {LIMIT_S} s")


def now():
    """Now, as the stamp of a header."""
    return divmod(time.time_ns(), 10**9)


def written(message, kind):
    """A message that `rosbags` has encoded, as Cyclone writes it."""
    made = JAZZY.serialize_cdr(message, message.__msgtype__)
    return kind.deserialize(bytes(made))


class Messages:
    """Messages encoded by `rosbags`."""

    def __init__(self):
        self.of = JAZZY.types

    def header(self, frame_id):
        sec, nanosec = now()
        stamp = self.of["builtin_interfaces/msg/Time"](sec, nanosec)
        return self.of["std_msgs/msg/Header"](stamp, frame_id)

    def range(self, range_m):
        made = self.of["sensor_msgs/msg/Range"](self.header("range"), 0, 0.1, 0.2, 20.0, range_m, 0.0)
        return written(made, Range)

    def number(self, value, kind=Float64):
        return written(self.of[f"std_msgs/msg/{kind.__name__}"](value), kind)

    def pressure(self, value):
        return written(self.of["sensor_msgs/msg/FluidPressure"](self.header("sensor"), value, 0.0), FluidPressure)

    def pose(self, z):
        of = self.of
        position, orientation = of["geometry_msgs/msg/Point"](1.0, 2.0, z), of["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
        return of["geometry_msgs/msg/Pose"](position, orientation)

    def pose_stamped(self, z):
        made = self.of["geometry_msgs/msg/PoseStamped"](self.header("map"), self.pose(z))
        return written(made, PoseStamped)

    def estimated_pose(self, z):
        made = self.of["geometry_msgs/msg/PoseWithCovarianceStamped"](self.header("map"), self.pose_with_covariance(z))
        return written(made, PoseWithCovarianceStamped)

    def pose_with_covariance(self, z):
        return self.of["geometry_msgs/msg/PoseWithCovariance"](self.pose(z), numpy.arange(36.0))

    def odometry(self, z):
        of, covariance = self.of, numpy.arange(36.0)
        zero = of["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
        pose = self.pose_with_covariance(z)
        twist = of["geometry_msgs/msg/TwistWithCovariance"](of["geometry_msgs/msg/Twist"](zero, zero), covariance)
        made = of["nav_msgs/msg/Odometry"](self.header("odom"), "base_link", pose, twist)
        return written(made, Odometry)

    def image(self, data):
        sec, nanosec = now()
        stamp = self.of["builtin_interfaces/msg/Time"](sec, nanosec)
        header = self.of["std_msgs/msg/Header"](stamp, "camera_optical")
        made = self.of["sensor_msgs/msg/CompressedImage"](header, "png", numpy.frombuffer(data, numpy.uint8))
        return written(made, CompressedImage)

    def raw(self, rows, encoding, padding=0):
        """Pixels as they are, with bytes of no meaning behind each row."""
        height, width = rows.shape[:2]
        data = numpy.pad(rows.reshape(height, -1), ((0, 0), (0, padding)), constant_values=99)
        of = self.of["sensor_msgs/msg/Image"]
        made = of(self.header("camera_optical"), height, width, encoding, 0, data.shape[1], data.reshape(-1))
        return written(made, RawImage)


class Nodes(unittest.TestCase):
    """One program and one other node."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.messages = Messages()

    def test_a_picture_is_answered_as_by_the_protocol(self):
        data = picture()
        with Program(self.folder) as program:
            peer = Peer(program.domain_id)
            depth = peer.depth(Float64)
            peer.wait(peer.range, peer.light, peer.image, depth)
            image = self.messages.image(data)
            for writer, message in [
                (peer.range, self.messages.range(0.75)),
                (depth, self.messages.number(3.0)),
                (peer.light, self.messages.number(20.0)),
            ]:
                writer.write(message)
            time.sleep(0.2)
            peer.image.write(image)
            made = peer.next(lambda made: (made.sec, made.nanosec) == (image.sec, image.nanosec))
            reply = program.answer_to(data)
        self.assertEqual(program.code, 0)
        self.assertTrue(reply["valid"] and reply["action"] == "move", reply)
        # By an independent decoder, from the file that users build.
        decoded = JAZZY.deserialize_cdr(made.raw, "uwguide_msgs/msg/Suggestion")
        self.assertEqual(decoded.header.frame_id, "camera_optical")
        self.assertEqual((decoded.header.stamp.sec, decoded.header.stamp.nanosec), (image.sec, image.nanosec))
        for name in ["valid", "action", "why"]:
            self.assertEqual(getattr(decoded, name), reply[name], name)
        numbers = ["distance_m", "light_pct", "delta_distance_m", "delta_light_pct", "score", "score_here", "gain"]
        for name in numbers:
            self.assertEqual(getattr(decoded, name), reply[name], name)
        for name in ["predicted_contrast", "predicted_here"]:
            self.assertEqual(list(getattr(decoded, name)), reply[name], name)
        self.assertEqual(list(decoded.residual_here), reply["residual_here"]["contrast"])
        self.assertEqual(decoded.residual_misfit, reply["residual_here"]["misfit"])
        self.assertEqual(len(decoded.warnings), len(reply["warnings"]))
        self.assertTrue(math.isnan(decoded.level_pct))
        # REP 103: along z of an optical frame, towards the target.
        self.assertEqual((decoded.displacement.x, decoded.displacement.y), (0.0, 0.0))
        self.assertEqual(decoded.displacement.z, -reply["delta_distance_m"])
        # What was sent back is what was decoded.
        again = JAZZY.serialize_cdr(decoded, "uwguide_msgs/msg/Suggestion")
        self.assertEqual(bytes(again), made.raw[: len(again)])

    def test_pixels_are_answered_as_the_same_picture(self):
        rows = pixels()
        with Program(self.folder, settings='image_type = "sensor_msgs/msg/Image"') as program:
            peer = Peer(program.domain_id, image=("rt/camera/image_raw", RawImage))
            depth = peer.depth(Float64)
            peer.wait(peer.range, peer.light, peer.image, depth)
            there = (depth, self.messages.number(3.0))
            made = self.answered(peer, self.messages.raw(rows[..., ::-1], "bgr8", padding=32), *there)
            # Pixels that are not read are told to those who listen.
            none = self.answered(peer, self.messages.raw(rows[..., 1], "8UC1"), *there)
            reply = program.answer_to(picture())
            # With fewer samples than colours.
            mosaic = rows[..., 1].copy()
            mosaic[::2, 1::2], mosaic[1::2, ::2] = rows[::2, 1::2, 0], rows[1::2, ::2, 2]
            fewer = {
                "bayer_grbg8": (mosaic, cv2.cvtColor(mosaic, cv2.COLOR_BayerGRBG2RGB)),
                "yuv422_yuy2": (yuyv := cv2.cvtColor(rows, cv2.COLOR_RGB2YUV_YUY2), cv2.cvtColor(yuyv, cv2.COLOR_YUV2RGB_YUY2)),
            }
            for encoding, (samples, colours) in fewer.items():
                answer, expected = self.answered(peer, self.messages.raw(samples, encoding), *there), program.answer_to(png(colours))
                self.assertTrue(answer.valid and expected["valid"], answer)
                # OpenCV has another rule at the very edge, and rounds otherwise.
                for name in ["score_here", "gain"]:
                    self.assertAlmostEqual(getattr(answer, name), expected[name], delta=1e-3, msg=encoding)
        self.assertTrue(made.valid and reply["valid"], made)
        self.assertEqual(made.frame_id, "camera_optical")
        for name in ["action", "why", "distance_m", "light_pct", "score", "score_here", "predicted_here"]:
            self.assertEqual(getattr(made, name), reply[name], name)
        self.assertEqual((none.valid, none.action, none.reason), (False, "hold", "bad_image"))
        self.assertIn('/camera/image_raw: encoding must be one of rgb8, bgr8', none.message)
        self.assertIn('got "8UC1"', none.message)

    def answered(self, peer, image, depth, made, others=None):
        """The suggestion for a picture and the depth `made`, sent again if best effort was not enough."""
        for _ in range(15):
            distance, light = others or (self.messages.range(0.75), self.messages.number(20.0))
            peer.range.write(distance)
            peer.light.write(light)
            for message in (made, image):
                if hasattr(message, "sec"):
                    message.sec, message.nanosec = now()
            depth.write(made)
            time.sleep(0.2)
            peer.image.write(image)
            try:
                return peer.next(lambda made: (made.sec, made.nanosec) == (image.sec, image.nanosec), LIMIT_S / 15)
            except AssertionError:
                continue
        raise AssertionError("no picture was answered")

    def test_topics_of_another_type_are_told(self):
        with Program(self.folder, settings='image_topic = "/camera/image_raw"') as program:
            peer = Peer(program.domain_id, image=("rt/camera/image_raw", RawImage))
            depth = peer.depth(FluidPressure)
            peer.wait(peer.range, peer.light)
            image = program.logged(["/camera/image_raw", "sensor_msgs/msg/Image elsewhere", "ros2.image_type"])
            self.assertIn("listened to as sensor_msgs/msg/CompressedImage", image)
            program.logged(["/depth", "sensor_msgs/msg/FluidPressure elsewhere", "ros2.depth_type"])
            self.assertFalse(depth.get_matched_subscriptions())
        log = (pathlib.Path(self.folder) / "log").read_text()
        self.assertEqual(log.count("elsewhere"), 2, log)

    def test_without_pictures_or_echoes_it_holds(self):
        with Program(self.folder, "sensor_msgs/msg/FluidPressure") as program:
            peer = Peer(program.domain_id)
            depth = peer.depth(FluidPressure)
            peer.wait(peer.range, peer.light, depth)
            missing = peer.next()
            self.assertFalse(missing.valid)
            self.assertEqual((missing.action, missing.reason), ("hold", "missing_input"))
            self.assertTrue(math.isnan(missing.distance_m))
            # A pressure of 3 m, and a range that is none: the distance stays missing.
            depth.write(self.messages.pressure(101325.0 + 3.0 * 1025.0 * 9.80665))
            peer.light.write(self.messages.number(20.0))
            peer.range.write(self.messages.range(math.inf))
            held = peer.next(lambda made: "depth" not in made.message)
            self.assertIn("distance", held.message)
            # Old news is not taken for new.
            old = self.messages.range(1.0)
            old.sec -= 60
            peer.range.write(old)
            held = peer.next(lambda made: "distance" not in made.message)
            self.assertFalse(held.valid)

    def test_depth_comes_as_a_height_or_a_position_too(self):
        for name, kind, setting, made in [
            ("geometry_msgs/msg/PoseStamped", PoseStamped, "", self.messages.pose_stamped(-3.25)),
            ("geometry_msgs/msg/PoseWithCovarianceStamped", PoseWithCovarianceStamped, "", self.messages.estimated_pose(-3.25)),
            ("nav_msgs/msg/Odometry", Odometry, "", self.messages.odometry(-3.25)),
            ("nav_msgs/msg/Odometry", Odometry, 'depth_axis = "down"', self.messages.odometry(3.25)),
            ("std_msgs/msg/Float64", Float64, 'depth_axis = "up"', self.messages.number(-3.25)),
        ]:
            with self.subTest(name, setting=setting), Program(self.folder, name, setting) as program:
                peer = Peer(program.domain_id)
                depth = peer.depth(kind)
                peer.wait(peer.range, peer.light, peer.image, depth)
                answered = self.answered(peer, self.messages.image(picture()), depth, made)
                reply = program.answer_to(picture(), depth_m=3.25)
                self.assertTrue(answered.valid, answered)
                self.assertEqual((answered.score, answered.distance_m), (reply["score"], reply["distance_m"]))

    def test_distance_depth_and_light_come_as_plain_numbers_too(self):
        for kind in (Float32, Float64):
            name = f"std_msgs/msg/{kind.__name__}"
            settings = f'range_type = "{name}"\nlight_type = "{name}"'
            with self.subTest(name), Program(self.folder, name, settings) as program:
                peer = Peer(program.domain_id, distance=kind, light=kind)
                depth = peer.depth(kind)
                peer.wait(peer.range, peer.light, peer.image, depth)
                distance, made, light = (self.messages.number(value, kind) for value in (0.75, 3.25, 20.0))
                answered = self.answered(peer, self.messages.image(picture()), depth, made, (distance, light))
                reply = program.answer_to(picture(), depth_m=3.25)
                self.assertTrue(answered.valid, answered)
                self.assertEqual((answered.score, answered.distance_m), (reply["score"], reply["distance_m"]))

    def test_messages_of_other_releases_are_read(self):
        # Humble's range has no variance: the bytes end before it.
        humble = store(Stores.ROS2_HUMBLE)
        stamp = humble.types["builtin_interfaces/msg/Time"](*now())
        header = humble.types["std_msgs/msg/Header"](stamp, "range")
        fields = {"header": header, "radiation_type": 0, "field_of_view": 0.1, "min_range": 0.2, "max_range": 20.0, "range": 1.0}
        made = humble.types["sensor_msgs/msg/Range"](**fields)
        short = humble.serialize_cdr(made, "sensor_msgs/msg/Range")
        long = JAZZY.serialize_cdr(JAZZY.types["sensor_msgs/msg/Range"](**fields, variance=0.0), "sensor_msgs/msg/Range")
        self.assertEqual(bytes(long)[: len(short)], bytes(short))
        self.assertEqual(len(long), len(short) + 4)

    def test_wrong_settings_are_told(self):
        for text, told in [
            ('range_topic = "range"', "ros2.range_topic must be an absolute topic name"),
            ("domain_id = 300", "ros2.domain_id must be a whole number from 0 to 232"),
            ('depth_type = "Float32"', "ros2.depth_type must be"),
            ('range_type = "nav_msgs/msg/Odometry"', 'ros2.range_type must be "sensor_msgs/msg/Range"'),
            ('light_type = "sensor_msgs/msg/Range"', 'ros2.light_type must be "std_msgs/msg/Float64" or "std_msgs/msg/Float32"'),
            ('depth_type = "sensor_msgs/msg/FluidPressure"\ndepth_axis = "up"', "ros2.depth_axis must be absent"),
            ('depth_axis = "z"', 'ros2.depth_axis must be "up" or "down"'),
            ('image_type = "Image"', 'ros2.image_type must be "sensor_msgs/msg/CompressedImage" or "sensor_msgs/msg/Image"'),
            ('reliable = "yes"', "ros2.reliable must be true or false"),
        ]:
            config = pathlib.Path(self.folder) / "wrong.toml"
            config.write_text(f'format = "uwguide-config/1"\n[ros2]\n{text}\n')
            done = subprocess.run([PROGRAM, "--profile", "1C", "--config", config, "--check-config"], capture_output=True, timeout=LIMIT_S)
            self.assertEqual(done.returncode, 2)
            self.assertIn(told, done.stderr.decode())
        environment = {**os.environ, "ROS_DOMAIN_ID": "many"}
        command = [PROGRAM, "--profile", "1C", "--ros2", "--listen", "127.0.0.1:0"]
        done = subprocess.run(command, capture_output=True, timeout=LIMIT_S, env=environment)
        self.assertEqual(done.returncode, 2)
        self.assertIn("ROS_DOMAIN_ID must be a whole number from 0 to 232", done.stderr.decode())


if __name__ == "__main__":
    unittest.main()
