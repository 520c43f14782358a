#!/usr/bin/env python3
"""Pictures of a ROS recording with the table that `uw calibrate` and `uw fit` take.

    pip install rosbags numpy opencv-python-headless
    python3 tools/bag_pictures.py DIVE -o pictures [--image-topic /camera/image_raw/compressed] [--every-s 1] [--light-pct 0]
    uw calibrate pictures/manifest.csv ..

DIVE is a recording of ROS 2 (a folder with SQLite or MCAP) or of ROS 1 (a .bag). Every picture that is at least --every-s after the one before is
written as it came (PNG, JPEG) or, where it came as pixels, as PNG. Depth, distance and light are those of the recording at its time, between the messages
before and after; where one of them is more than --gap-s away the picture is left out. Numbers may come as Float64, Float32, Range, FluidPressure, or z of a
PoseStamped, PoseWithCovarianceStamped or Odometry. What changed between two pictures of one sight (exposure above all) no recording tells.

The camera's calibration, where the recording has it (CameraInfo, beside the pictures or as --camera-info-topic says), becomes camera.yaml beside them, for
`--camera`.
"""

import argparse
import bisect
import csv
import io
import math
import os
import sys
from pathlib import Path

import cv2
import numpy as np
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.typesys import Stores, get_typestore

GRAVITY_M_PER_S2 = 9.80665
RANGE = "sensor_msgs/msg/Range"
FLOATS = ("std_msgs/msg/Float64", "std_msgs/msg/Float32")
POSES = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped", "nav_msgs/msg/Odometry")
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
# Channels of a pixel, and what makes of them the order that OpenCV writes; with samples of 8 bits and of 16.
OF_BOTH_SIZES = {
    "mono": (1, None),
    "bgr": (3, None),
    "rgb": (3, cv2.COLOR_RGB2BGR),
    "bgra": (4, cv2.COLOR_BGRA2BGR),
    "rgba": (4, cv2.COLOR_RGBA2BGR),
    "bayer_rggb": (1, cv2.COLOR_BayerRGGB2BGR),
    "bayer_bggr": (1, cv2.COLOR_BayerBGGR2BGR),
    "bayer_grbg": (1, cv2.COLOR_BayerGRBG2BGR),
    "bayer_gbrg": (1, cv2.COLOR_BayerGBRG2BGR),
}
UYVY, YUYV = (2, 8, cv2.COLOR_YUV2BGR_UYVY), (2, 8, cv2.COLOR_YUV2BGR_YUY2)
ENCODINGS = {f"{name}{bits}": (channels, bits, code) for name, (channels, code) in OF_BOTH_SIZES.items() for bits in (8, 16)}
ENCODINGS |= {"yuv422": UYVY, "uyvy": UYVY, "yuv422_yuy2": YUYV, "yuyv": YUYV}
COLUMNS = ["file", "kind", "depth_m", "distance_m", "light_pct"]


class Unusable(Exception):
    """What a recording lacks, for people."""


class Track:
    """A number over time."""

    def __init__(self, topic):
        self.topic, self.times_s, self.values = topic, [], []

    def add(self, time_s, value):
        if value is not None and math.isfinite(value):
            self.times_s.append(time_s)
            self.values.append(value)

    def at(self, time_s, gap_s):
        """Between the messages before and after, or None where either is further away."""
        after = bisect.bisect_left(self.times_s, time_s)
        if after < len(self.times_s) and self.times_s[after] == time_s:
            return self.values[after]
        if after == len(self.times_s) or after == 0:
            near = min(after, len(self.times_s) - 1)
            return self.values[near] if near >= 0 and abs(self.times_s[near] - time_s) <= gap_s else None
        (early, late), (low, high) = self.times_s[after - 1 : after + 1], self.values[after - 1 : after + 1]
        if time_s - early > gap_s or late - time_s > gap_s:
            return None
        return low + (high - low) * (time_s - early) / (late - early)


def seconds(message, recorded_ns):
    """When a message was made: its stamp, or when it was recorded where it has none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None or (stamp.sec, stamp.nanosec) == (0, 0):
        return 1e-9 * recorded_ns
    return stamp.sec + 1e-9 * stamp.nanosec


def depth_m(message, kind, arguments):
    """Below the surface."""
    if kind == "sensor_msgs/msg/FluidPressure":
        above_pa = message.fluid_pressure - arguments.surface_pressure_pa
        return max(0.0, above_pa / (arguments.water_density_kg_per_m3 * GRAVITY_M_PER_S2))
    pose = getattr(message, "pose", None)
    pose = getattr(pose, "pose", pose)
    value, usual = (message.data, "down") if pose is None else (pose.position.z, "up")
    return value if (arguments.depth_axis or usual) == "down" else -value


def distance_m(message, kind, arguments):
    """None without an echo (REP 117)."""
    if kind != RANGE:
        return message.data + arguments.range_offset_m
    limited = message.min_range < message.max_range
    seen = math.isfinite(message.range) and message.range > 0.0
    if not seen or (limited and not message.min_range <= message.range <= message.max_range):
        return None
    return message.range + arguments.range_offset_m


def picture(message, kind):
    """Ending and bytes of a file."""
    if kind == "sensor_msgs/msg/CompressedImage":
        data = bytes(message.data)
        ending = {b"\x89PN": ".png", b"\xff\xd8\xff": ".jpg"}.get(data[:3])
        if ending is None:
            raise Unusable(f"pictures must be PNG or JPEG, got format {message.format!r}")
        return ending, data
    if message.encoding not in ENCODINGS:
        raise Unusable(f"the encoding of pictures must be one of {', '.join(ENCODINGS)}, got {message.encoding!r}")
    channels, bits, code = ENCODINGS[message.encoding]
    row = message.width * channels * bits // 8
    needed = message.height * message.step
    if message.step < row or len(message.data) < needed:
        raise Unusable(
            f"a picture of {message.width} x {message.height} {message.encoding} needs steps of {row} bytes and {needed} in all, "
            f"got {message.step} and {len(message.data)}"
        )
    rows = np.frombuffer(bytes(message.data), np.uint8)[:needed].reshape(message.height, message.step)[:, :row]
    sample = np.dtype(np.uint8 if bits == 8 else np.uint16).newbyteorder(">" if message.is_bigendian else "<")
    pixels = np.ascontiguousarray(rows).view(sample).astype(sample.newbyteorder("=")).reshape(message.height, message.width, channels)
    try:
        written, file = cv2.imencode(".png", pixels if code is None else cv2.cvtColor(pixels, code))
    except cv2.error as error:
        raise Unusable(f"a picture of {message.width} x {message.height} {message.encoding} cannot be read: {error}") from error
    if not written:
        raise Unusable(f"a picture of {message.width} x {message.height} {message.encoding} cannot be written")
    return ".png", file.tobytes()


def camera_info_topic(reader, arguments):
    """As it is given, else the one of the pictures' camera, else None."""
    if arguments.camera_info_topic:
        return arguments.camera_info_topic
    parts = arguments.image_topic.split("/")
    # /camera/image_raw and /camera/image_raw/compressed have /camera/camera_info beside them.
    beside = {"/".join([*parts[:depth], "camera_info"]) for depth in (len(parts) - 1, len(parts) - 2) if depth > 0}
    found = {connection.topic for connection in reader.connections if connection.msgtype == CAMERA_INFO} & beside
    return max(found, key=len, default=None)


def is_rectified(image_topic):
    """By its name, as `image_proc` gives it: image_rect, image_rect_color."""
    return "rect" in image_topic.removesuffix("/compressed").rsplit("/", 1)[-1]


def calibration(message, rectified):
    """As `camera_calibration` writes it. Rectified pictures have the projection's matrix and no lens."""
    k, d, p = ([float(x) for x in getattr(message, name, getattr(message, name.upper(), ()))] for name in "kdp")
    roi, model = message.roi, message.distortion_model
    if rectified or not model:
        model = "plumb_bob"
    if rectified:
        k, d = [*p[0:3], *p[4:7], *p[8:11]], []
    if k[0] <= 0.0:
        raise Unusable(f"the camera was not calibrated ({'P' if rectified else 'K'} is 0)")
    if max(message.binning_x, message.binning_y) > 1 or any([roi.x_offset, roi.y_offset, roi.width, roi.height]):
        raise Unusable("pictures that are binned or a part of the sensor's have no calibration of their own")
    return (
        f"image_width: {message.width}\nimage_height: {message.height}\n"
        f"camera_matrix:\n  rows: 3\n  cols: 3\n  data: {k}\n"
        f"distortion_model: {model}\n"
        f"distortion_coefficients:\n  rows: 1\n  cols: {len(d)}\n  data: {d}\n"
    )


def write_calibration(reader, found, arguments):
    """Writes the first that there is; what became of it, for people."""
    for connection, _, data in reader.messages(connections=found["camera-info"]):
        file = arguments.output / "camera.yaml"
        try:
            write(file, calibration(reader.deserialize(data, connection.msgtype), is_rectified(arguments.image_topic)).encode())
        except Unusable as error:
            return f"no calibration of the camera from {connection.topic}: {error}"
        return f"the camera's calibration: {file} (--camera)"
    return f"no calibration of the camera: {found['camera-info'][0].topic} is empty"


def topics(reader, arguments):
    """Connections of the topics by what they tell, with the types that they may have."""
    known = {
        "image": (arguments.image_topic, ("sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/Image")),
        "depth": (arguments.depth_topic, (*FLOATS, *POSES, "sensor_msgs/msg/FluidPressure")),
        "distance": (arguments.range_topic, (*FLOATS, RANGE)),
    }
    if arguments.light_pct is None:
        known["light"] = (arguments.light_topic, FLOATS)
    camera_info = camera_info_topic(reader, arguments)
    if camera_info:
        known["camera-info"] = (camera_info, (CAMERA_INFO,))
    found = {}
    for tells, (topic, types) in known.items():
        of = [connection for connection in reader.connections if connection.topic == topic]
        if not of:
            there = ", ".join(sorted({f"{c.topic} ({c.msgtype})" for c in reader.connections})) or "nothing"
            hint = " (--light-pct, where the lamps stayed as they were)" if tells == "light" else ""
            raise Unusable(f"--{'range' if tells == 'distance' else tells}-topic {topic} is not in the recording{hint}; there: {there}")
        if of[0].msgtype not in types:
            raise Unusable(f"{topic} must be one of {', '.join(types)}, got {of[0].msgtype}")
        found[tells] = of
    return found


def tracks(reader, found, arguments):
    """What is known of each time."""
    of = {
        "depth": depth_m,
        "distance": distance_m,
        "light": lambda message, _, __: message.data,
    }
    made = {}
    for tells in found.keys() - {"image", "camera-info"}:
        track = made[tells] = Track(found[tells][0].topic)
        for connection, recorded_ns, data in reader.messages(connections=found[tells]):
            message = reader.deserialize(data, connection.msgtype)
            track.add(seconds(message, recorded_ns), of[tells](message, connection.msgtype, arguments))
        order = sorted(range(len(track.times_s)), key=track.times_s.__getitem__)
        track.times_s, track.values = [track.times_s[i] for i in order], [track.values[i] for i in order]
    return made


def write(path, data):
    """Under another name first, so that a file is whole."""
    part = path.with_name(path.name + ".part")
    part.write_bytes(data)
    os.replace(part, path)


def extract(reader, found, arguments):
    """Writes the pictures; rows of the table, and how many were left out for which topic."""
    known = tracks(reader, found, arguments)
    rows, left_out, last_s = [], {}, -math.inf
    for connection, recorded_ns, data in reader.messages(connections=found["image"]):
        message = reader.deserialize(data, connection.msgtype)
        time_s = seconds(message, recorded_ns)
        if time_s - last_s < arguments.every_s:
            continue
        at = {tells: track.at(time_s, arguments.gap_s) for tells, track in known.items()}
        at.setdefault("light", arguments.light_pct)
        missing = [tells for tells in ("depth", "distance", "light") if at[tells] is None]
        if missing:
            left_out[known[missing[0]].topic] = left_out.get(known[missing[0]].topic, 0) + 1
            continue
        last_s = time_s
        ending, file = picture(message, connection.msgtype)
        name = f"{len(rows) + 1:06}{ending}"
        write(arguments.output / name, file)
        rows.append([name, arguments.kind, *(f"{at[tells]:.4g}" for tells in ("depth", "distance", "light"))])
    return rows, left_out


def arguments_of(words):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for pictures and manifest.csv")
    parser.add_argument("--image-topic", default="/camera/image_raw/compressed")
    parser.add_argument("--camera-info-topic", help="the camera's calibration; without it camera_info beside the pictures")
    parser.add_argument("--depth-topic", default="/depth", help="depth below the surface, m, or pressure, Pa")
    parser.add_argument("--depth-axis", choices=["up", "down"], help="which way it grows; without it down for numbers, up for poses")
    parser.add_argument("--range-topic", default="/range", help="distance of the target along the optical axis, m")
    parser.add_argument("--range-offset-m", type=float, default=0.0, help="what is added to a range for the camera's distance")
    parser.add_argument("--light-topic", default="/light_pct", help="light of the lamps, percent of full")
    parser.add_argument("--light-pct", type=float, help="in its place, where the lamps stayed as they were")
    parser.add_argument("--every-s", type=float, default=1.0, help="least time between pictures (default: 1)")
    parser.add_argument("--gap-s", type=float, default=1.0, help="how far away depth, distance and light may be in time (default: 1)")
    parser.add_argument("--kind", choices=["contrast", "depth"], default="contrast", help="depth: the camera looks up (default: contrast)")
    parser.add_argument("--surface-pressure-pa", type=float, default=101325.0)
    parser.add_argument("--water-density-kg-per-m3", type=float, default=1025.0)
    return parser.parse_args(words)


def main(words=None):
    arguments = arguments_of(words)
    try:
        if (arguments.output / "manifest.csv").exists():
            raise Unusable(f"{arguments.output}: has a manifest.csv already; take another folder")
        if not arguments.recording.exists():
            raise Unusable("is not there")
        with AnyReader([arguments.recording], default_typestore=get_typestore(Stores.LATEST)) as reader:
            arguments.output.mkdir(parents=True, exist_ok=True)
            found = topics(reader, arguments)
            rows, left_out = extract(reader, found, arguments)
            if not rows:
                raise Unusable(f"no picture has depth, distance and light within {arguments.gap_s:g} s (--gap-s)")
            told = write_calibration(reader, found, arguments) if "camera-info" in found else ""
    except (Unusable, AnyReaderError, OSError) as error:
        print(f"{arguments.recording}: {error}", file=sys.stderr)
        return 2
    table = io.StringIO()
    csv.writer(table, lineterminator="\n").writerows([COLUMNS, *rows])
    write(arguments.output / "manifest.csv", table.getvalue().encode())
    for topic, count in left_out.items():
        print(f"{count} pictures left out: nothing of {topic} within {arguments.gap_s:g} s", file=sys.stderr)
    print(f"{len(rows)} pictures and {arguments.output / 'manifest.csv'}")
    if told:
        print(told)
    return 0


if __name__ == "__main__":
    sys.exit(main())
