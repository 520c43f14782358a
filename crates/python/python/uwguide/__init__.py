"""Underwater images as physics makes them, and advice for an underwater vehicle.

A picture::

    import uwguide

    scene = uwguide.Scene.from_file("flat_hull", width=320)
    picture = uwguide.render(scene, spp=16)
    uwguide.save("hull.png", uwguide.expose(picture["image"], scene))

Units are in the names: ``_m`` metres, ``_pct`` percent, ``_deg`` degrees, ``_s`` seconds; coefficients in 1/m, radiance in
W/(m² sr), irradiance in W/m², contrast and means of pictures in 8-bit counts. Channels are red, green, blue, in this order. Row 0
of a picture is the top. Whatever cannot be used raises ``ValueError``, with the same text as that of the command line ``uw``.

Scenes, models and profiles that ship with the package go by their names (``"flat_hull"``, ``"1C"``); how they are looked for, scene
files, profiles, model and water files are those of ``docs/interfaces.md``.
"""

import os as _os

if "XDG_RUNTIME_DIR" not in _os.environ:
    # Without a desktop, Mesa's layer that chooses among graphics devices writes to standard error.
    _os.environ.setdefault("NODEVICE_SELECT", "1")

from ._calibration import calibrate, fit
from ._guide import Guide
from ._measures import contrast, stats
from ._native import Profile, Scene, Water
from ._rendering import Layers, expose, irradiance, render, save
from .client import Client, Refused

__all__ = [
    "Client",
    "Guide",
    "Layers",
    "Profile",
    "Refused",
    "Scene",
    "Water",
    "calibrate",
    "contrast",
    "expose",
    "fit",
    "irradiance",
    "render",
    "save",
    "stats",
]
