"""The programs `uw` and `uwguide` that the module is compared with, and pictures that tests share.

They are taken from the folder UWGUIDE_PROGRAMS, else from target/release of the repository.
"""

import contextlib
import json
import os
import pathlib
import subprocess
import warnings

import numpy as np

REPOSITORY = pathlib.Path(__file__).resolve().parents[3]
PROGRAMS = pathlib.Path(os.environ.get("UWGUIDE_PROGRAMS", REPOSITORY / "target" / "release"))
# A program that does not end is a failure, not a test that hangs.
LIMIT_S = 300


def uw(*arguments):
    """Runs `uw`; its standard output."""
    done = uw_result(*arguments)
    if done.returncode != 0:
        raise AssertionError(f"uw {arguments}: {done.stderr}")
    return done.stdout


def uw_result(*arguments, environment=None):
    """Runs `uw`, however it ends."""
    command = [PROGRAMS / "uw", *map(str, arguments)]
    environment = {**os.environ, **(environment or {})}
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=LIMIT_S, check=False)


def uw_error(*arguments, environment=None):
    """The text of the error that `uw` ends with."""
    done = uw_result(*arguments, environment=environment)
    if done.returncode == 0:
        raise AssertionError(f"uw {arguments} has not failed")
    # Warnings come before it; an error may have several lines.
    return ("\n" + done.stderr.strip()).rpartition("\nuw: ")[2]


def uw_stats(*arguments):
    """What `uw stats` tells of one picture."""
    (told,) = json.loads(uw("--json", "stats", *arguments))
    return told


@contextlib.contextmanager
def quiet():
    """Warnings that a test is not about."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def exr_layers(file):
    """Arrays by the names of layers of an EXR file, the picture as "image"; read by OpenEXR, which knows nothing of this project."""
    import OpenEXR

    with OpenEXR.File(str(file), separate_channels=True) as exr:
        channels = {name: np.array(channel.pixels) for name, channel in exr.channels().items()}
    groups = {}
    for name, pixels in channels.items():
        layer, _, channel = name.rpartition(".")
        groups.setdefault(layer or "image", {})[channel] = pixels
    return {layer: joined(group) for layer, group in groups.items()}


def joined(group):
    """An array of the channels R, G, B or X, Y, Z, or of the one channel Z."""
    if list(group) == ["Z"]:
        return group["Z"]
    return np.stack([group[name] for name in ("RGB" if "R" in group else "XYZ")], axis=-1)


def a_picture(height=72, width=120, dtype=np.uint8):
    """A picture with detail of every size, the same at every call."""
    numbers = np.random.default_rng(7)
    most = np.iinfo(dtype).max
    y, x = np.mgrid[0:height, 0:width]
    waves = 0.5 + 0.2 * np.sin(x / 7.0) + 0.1 * np.cos(y / 3.0)
    channels = [share * waves + 0.02 * numbers.standard_normal((height, width)) for share in (0.5, 1.0, 0.8)]
    return (most * np.clip(np.stack(channels, axis=-1), 0.0, 1.0)).astype(dtype)


# A lamp before a plane, which renders in a moment.
LAMP_SCENE = {
    "format": "uw-scene/1",
    "water": {"jerlov": "3C", "bands": "mean"},
    "camera": {"position_m": [0, 0, 0], "forward": [1, 0, 0], "hfov_deg": 60.0, "width": 48, "height": 27},
    "lamp": [
        {
            "name": "left",
            "position_m": [0.0, 0.3, 0.0],
            "forward": [1.0, 0.0, 0.0],
            "intensity": [10.0, 10.0, 10.0],
            "half_angle_deg": 50.0,
        }
    ],
    "object": [
        {"plane": {"center_m": [1.5, 0, 0], "normal": [-1, 0, 0], "size_m": [8, 8]}, "reflectance": [0.3, 0.5, 0.2]}
    ],
}

LAMP_SCENE_TEXT = """
format = "uw-scene/1"
[water]
jerlov = "3C"
bands = "mean"
[camera]
position_m = [0, 0, 0]
forward = [1, 0, 0]
hfov_deg = 60.0
width = 48
height = 27
[[lamp]]
name = "left"
position_m = [0.0, 0.3, 0.0]
forward = [1.0, 0.0, 0.0]
intensity = [10.0, 10.0, 10.0]
half_angle_deg = 50.0
[[object]]
plane = { center_m = [1.5, 0, 0], normal = [-1, 0, 0], size_m = [8, 8] }
reflectance = [0.3, 0.5, 0.2]
"""
