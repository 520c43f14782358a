"""Guidance in this process."""

import base64
import json
import os
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _native
from ._arguments import PathLike, ProfileLike, pixels_of, told
from ._native import Profile, Water


class Guide:
    """Advice for a vehicle without a daemon: the answers of ``uwguide`` to the same requests, by network or by physics.

    It keeps the latest state, as the daemon does (:meth:`state`). Replies have the fields of the daemon's (docs/interfaces.md,
    section 6). One may be used from several threads.
    """

    def __init__(
        self,
        model: Optional[PathLike] = None,
        profile: Optional[ProfileLike] = None,
        *,
        water: Optional[Union[Water, PathLike]] = None,
        objective: Optional[Mapping[str, Any]] = None,
        camera: Optional[PathLike] = None,
        mask: Optional[PathLike] = None,
    ):
        """Loads what contrast is predicted from.

        Args:
            model: a model file (uw-mlp) or the name of a shipped one; None for the shipped default, or with `water`.
            profile: a :class:`Profile`, the path of a profile file, the name of a shipped one, or its contents as a dictionary. None: by physics an
                objective of the form "overlap" (preset "tracking") needs none; other answers are to hold (``no_profile``).
            water: in the place of a model: a :class:`Water` or the path of a water file (uw-water/1), for predictions by physics
                from pictures.
            objective: fields of the objective in the place of its defaults, such as ``{"preset": "tracking"}``.
            camera: the camera that takes the pictures of :meth:`suggest`: a scene file whose ``[camera]`` has their size, lens and port, or a calibration (``*.yaml``, ``*.xml``) of ROS, OpenCV, Kalibr or Metashape. They are
                measured as the ideal camera of model or water would have taken them.
            mask: what of them is not the target, as of :func:`uwguide.calibrate`.

        Raises:
            ValueError: a file that cannot be used.
        """
        if model is not None and water is not None:
            raise ValueError("model and water must not be given both")
        if profile is not None and not isinstance(profile, Profile):
            profile = _profile_of(profile)
        if water is not None and not isinstance(water, Water):
            water = Water.from_file(water)
        self._answers = _native.Answers(
            model,
            water,
            profile,
            camera=None if camera is None else os.fspath(camera),
            mask=None if mask is None else os.fspath(mask),
        )
        self._objective = None if objective is None else dict(objective)

    def request(self, op: str, **fields: Any) -> Dict[str, Any]:
        """Asks a request of the daemon's protocol.

        Raises:
            ValueError: the reply is an error; the text is its message.
        """
        line = json.dumps({"op": op, **fields}, allow_nan=False, default=_plain)
        reply: Dict[str, Any] = json.loads(self._answers.reply(line))
        if reply.pop("ok") is not True:
            raise ValueError(reply["error"]["message"])
        reply.pop("id")
        return reply

    def suggest(self, image: Optional[Union[np.ndarray, PathLike]] = None, **state: Any) -> Dict[str, Any]:
        """The best distance and lamp level; act only when ``valid`` is true and ``action`` is "move".

        Args:
            image: the current picture: an array of uint8 (shapes as of :func:`uwguide.contrast`) or the path of a PNG, TIFF or
                JPEG file. Without it give its numbers, ``mean`` and ``std`` (the contrast), three 8-bit counts each, and its
                ``width`` and ``height`` in pixels.
            state: ``depth_m``, ``distance_m`` (m), ``light_pct`` (percent), and any other field of a request ``suggest``, such as
                ``objective``. What is left out comes from the latest :meth:`state`.

        Returns:
            ``distance_m``, ``light_pct``, ``delta_distance_m``, ``delta_light_pct``, ``predicted_contrast``, ``score``, ``valid``,
            ``action``, ``reason``, ``why``, ``warnings`` and the other fields of the daemon's reply.

        Raises:
            ValueError: a field that is missing or cannot be used.
        """
        if image is None:
            return self.request("suggest", **self._aim(state))
        encoded = base64.b64encode(_encoded(image)).decode()
        return self.request("suggest_image", image={"base64_png": encoded}, **self._aim(state))

    def predict(self, candidates: Sequence[Tuple[float, float]], **state: Any) -> Dict[str, Any]:
        """Contrast (8-bit counts) and score of pairs (distance_m, light_pct)."""
        pairs = [list(pair) for pair in candidates]
        return self.request("predict", candidates=pairs, **self._aim(state))

    def state(self, **state: Any) -> Dict[str, Any]:
        """Feeds any part of the vehicle's state, which later requests take what they leave out from."""
        return self.request("state", **state)

    def info(self) -> Dict[str, Any]:
        """Model or water, profile and settings in use."""
        return self.request("info")

    def _aim(self, state: Dict[str, Any]) -> Dict[str, Any]:
        if self._objective is None:
            return state
        return {**state, "objective": {**self._objective, **state.get("objective", {})}}


def _profile_of(profile: ProfileLike) -> Profile:
    if isinstance(profile, Mapping):
        return Profile.from_json(json.dumps(dict(profile), default=_plain))
    if isinstance(profile, (str, os.PathLike)):
        return Profile.from_file(profile)
    raise ValueError(f"profile must be a Profile, a path, a name or a dictionary, got {profile!r}")


def _encoded(image: Union[np.ndarray, PathLike]) -> bytes:
    """The bytes of a picture's file."""
    if isinstance(image, (str, os.PathLike)):
        try:
            with open(image, "rb") as file:
                return file.read()
        except OSError as error:
            raise ValueError(f"{os.fspath(image)}: cannot be read: {error.strerror}") from error
    array = pixels_of(image)
    if array.dtype != np.uint8:
        raise ValueError(f"image must be uint8, got {told(array)}; uwguide.expose makes it of radiance")
    return _native.encode_png(array)


def _plain(value: Any) -> Any:
    """Numbers and arrays of numpy as JSON has them."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise ValueError(f"{value!r} cannot be sent: it must be a number, a text, a list or a dictionary")
