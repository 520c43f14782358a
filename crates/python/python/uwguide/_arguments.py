"""Arguments of users, as the compiled part takes them."""

import os
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from ._native import Profile, Scene

PathLike = Union[str, "os.PathLike[str]"]
SceneLike = Union[Scene, PathLike, Mapping[str, Any]]
ProfileLike = Union[Profile, PathLike, Mapping[str, Any]]


def scene_of(scene: SceneLike) -> Scene:
    """A scene: itself, or of a file, a shipped scene's name or a dictionary."""
    if isinstance(scene, Scene):
        return scene
    if isinstance(scene, Mapping):
        return Scene.from_dict(plain(scene))
    if isinstance(scene, (str, os.PathLike)):
        return Scene.from_file(scene)
    raise ValueError(f"scene must be a Scene, a path, a name or a dictionary, got {scene!r}")


def plain(mapping: Mapping[str, Any]) -> Dict[str, Any]:
    """The mapping as a dictionary."""
    return mapping if isinstance(mapping, dict) else dict(mapping)


def radiance_of(image: Any) -> np.ndarray:
    """An array of radiance, height x width x 3, float32 without gaps."""
    array = np.asarray(image)
    if array.ndim != 3 or array.shape[2] != 3 or array.dtype.kind != "f":
        raise ValueError(f"image must be an array of floats of shape (height, width, 3), got {told(array)}")
    return np.ascontiguousarray(array, dtype=np.float32)


def pixels_of(image: Any) -> np.ndarray:
    """An array of a picture, height x width x 3 without gaps: grey is replicated, alpha left out."""
    array = np.asarray(image)
    if array.ndim == 2:
        array = array[..., np.newaxis]
    if array.ndim != 3 or array.shape[2] not in (1, 2, 3, 4):
        raise ValueError(
            f"image must be an array of shape (height, width) or (height, width, 1 to 4), got {told(array)}"
        )
    if array.shape[2] < 3:
        array = np.repeat(array[..., :1], 3, axis=2)
    return np.ascontiguousarray(array[..., :3])


def told(array: np.ndarray) -> str:
    """Shape and kind of an array, for messages."""
    return f"{array.dtype} of shape {array.shape}"


def noise_of(noise_a: Optional[float], noise_b: Optional[float]) -> Optional[Tuple[float, float]]:
    """The sensor's noise, or None where it is to be found in the pictures."""
    if (noise_a is None) != (noise_b is None):
        raise ValueError(f"noise_a and noise_b go together, got {noise_a} and {noise_b}")
    return None if noise_a is None or noise_b is None else (noise_a, noise_b)


def names_of(layers: Union[str, Sequence[str]]) -> Sequence[str]:
    """Names of layers; a single text is one name."""
    return [layers] if isinstance(layers, str) else list(layers)
