"""The converged pictures of `assets/benchmarks/references`, and how far a picture is from one."""

import pathlib

import numpy as np
import OpenEXR

BENCHMARKS = pathlib.Path(__file__).resolve().parents[2] / "assets/benchmarks"


def reference(name):
    """The converged picture of a scene: radiance, rows x columns x 3."""
    stored = OpenEXR.File(str(BENCHMARKS / "references" / f"{name}_320x180.exr"))
    return np.asarray(stored.channels()["RGB"].pixels, dtype=float) / float(stored.header()["uw.scale"])


def rel_mse(picture, ref):
    """Relative mean squared error as `uw error-time` measures it."""
    return np.mean((picture - ref) ** 2 / (ref**2 + 1e-4 * ref.mean() ** 2))
