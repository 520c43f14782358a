"""Contrast and other measures of pictures."""

import json
import os
import warnings
from typing import Any, Dict, Optional, Union

import numpy as np

from . import _native
from ._arguments import PathLike, noise_of, pixels_of, told

Image = Union[np.ndarray, PathLike]


def contrast(image: Image) -> np.ndarray:
    """Contrast per channel: mean over a 10 x 6 grid of patches of the standard deviation inside each; that of ``uw stats``.

    Args:
        image: an array of shape (height, width), (height, width, 3) or with alpha, at least 10 x 6 pixels: uint8, uint16 (scaled
            to 8 bits), or floats that are 8-bit counts in [0, 255]; or the path of a PNG, TIFF or JPEG file. Radiance becomes
            counts by :func:`expose`.

    Returns:
        float64 of shape (3,): red, green, blue, in 8-bit counts.

    Raises:
        ValueError: a picture that cannot be read or measured.
    """
    if isinstance(image, (str, os.PathLike)):
        return np.array(stats(image)["contrast"])
    array = pixels_of(image)
    if array.dtype.kind != "f":
        return np.array(stats(array)["contrast"])
    counts = np.ascontiguousarray(array, dtype=np.float64)
    if not (np.isfinite(counts).all() and (counts >= 0).all() and (counts <= 255).all()):
        raise ValueError(
            "image of floats must be 8-bit counts, finite and within [0, 255], got other values; uwguide.expose makes counts of radiance"
        )
    if counts.size and counts.max() <= 1:
        warnings.warn(
            "no value of the image is above 1: floats are taken as 8-bit counts (0 to 255); uwguide.expose makes counts of radiance",
            stacklevel=2,
        )
    return np.array(_native.contrast_of_counts(counts))


def stats(
    image: Image,
    *,
    vehicle: Optional[PathLike] = None,
    noise_a: Optional[float] = None,
    noise_b: Optional[float] = None,
    encoding: Optional[str] = None,
) -> Dict[str, Any]:
    """What ``uw stats --json`` tells of a picture: contrast and mean, contrast without noise, noise floor, clipped pixels.

    Args:
        image: an array of uint8 or uint16, or the path of a PNG, TIFF or JPEG file or of a folder of frames of one view; shapes as of :func:`contrast`.
        vehicle: vehicle that took it, a name among the shipped ones or a file (\\*.toml): its encoding and noise serve where they are
            not given, its vignetting is taken out of the picture.
        noise_a: noise of the camera: the variance of a linear signal y in [0, 1] is noise_a y + noise_b. Without it that of the
            vehicle, without one it is found from differences of neighbouring pixels.
        noise_b: see `noise_a`.
        encoding: how counts stand for light, "srgb" or "linear"; None for the vehicle's, "srgb" without one.

    Returns:
        "width", "height" in pixels; "contrast", "mean", "contrast_corrected", "noise_floor", "noise" in 8-bit counts, "black",
        "saturated" as shares in [0, 1], a list of three each, None where patches are too small to tell; "noise_source",
        "jpeg_quality", "noise_share"; "exposure_time_s", "f_number", "iso", "exposure" of a file's EXIF or None; "warnings".
    """
    told_of: Dict[str, Any] = json.loads(
        _measured(image, _native.Camera(None if vehicle is None else os.fspath(vehicle), encoding, noise_of(noise_a, noise_b)))
    )
    return told_of


def _measured(image: Image, camera: _native.Camera) -> str:
    if isinstance(image, (str, os.PathLike)):
        return _native.measure_file(image, camera)
    array = pixels_of(image)
    if array.dtype == np.uint8:
        return _native.measure_rgb8(array, camera)
    if array.dtype == np.uint16:
        return _native.measure_rgb16(array, camera)
    raise ValueError(f"image must be uint8 or uint16, got {told(array)}; uwguide.expose makes them of radiance")
