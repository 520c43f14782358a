"""The compiled part of ``uwguide``; ``Scene``, ``Profile`` and ``Water`` are public, the rest is wrapped by the package."""

import os
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union, final

import numpy as np
import numpy.typing as npt

_Path = Union[str, "os.PathLike[str]"]
_Noise = Optional[Tuple[float, float]]
_Doubles = npt.NDArray[np.float64]
_Radiance = npt.NDArray[np.float32]

@final
class Scene:
    """A scene, complete and checked: water, lamps, sun, camera, objects, sensor."""

    @classmethod
    def from_file(
        cls,
        file: _Path,
        *,
        settings: Optional[Dict[str, Any]] = None,
        width: Optional[int] = None,
        height: Optional[int] = None,
    ) -> Scene:
        """Reads a scene file (uw-scene/1), or a shipped scene by its name; `width` and `height` in pixels."""
    @classmethod
    def from_dict(
        cls,
        scene: Dict[str, Any],
        *,
        base_dir: Optional[_Path] = None,
        width: Optional[int] = None,
        height: Optional[int] = None,
    ) -> Scene:
        """Makes a scene of a dictionary with the tables and fields of a scene file."""
    @property
    def width(self) -> int:
        """Width of its pictures, pixels."""
    @property
    def height(self) -> int:
        """Height of its pictures, pixels."""
    @property
    def lamps(self) -> List[str]:
        """Names of the lamps, in order."""
    @property
    def warnings(self) -> List[str]:
        """What was read but cannot be honoured, a sentence each."""

@final
class Profile:
    """A calibration profile (uw-profile/1): K_z by depth, K_c by distance."""

    @classmethod
    def from_file(cls, file: _Path) -> Profile:
        """Reads a profile file, or a shipped profile by its name, as in "1C"."""
    @classmethod
    def from_json(cls, text: str) -> Profile:
        """Makes a profile of the JSON text of a profile file."""
    def to_json(self) -> str:
        """The JSON text of its file."""
    def write(self, file: _Path) -> None:
        """Writes its file, whole or not at all."""
    def k_z(self, depth_m: float) -> _Doubles:
        """K_z at a depth in m, no unit; shape (3,)."""
    def k_c_on(self, distance_m: float) -> _Doubles:
        """K_c with the lamps on from a distance in m, 8-bit counts; shape (3,)."""
    def k_c_off(self, distance_m: float) -> _Doubles:
        """K_c with the lamps off from a distance in m, 8-bit counts; shape (3,)."""
    @property
    def depth(self) -> Tuple[_Doubles, _Doubles]:
        """Depths in m, shape (N,), and K_z, no unit, shape (N, 3)."""
    @property
    def contrast_on(self) -> Tuple[_Doubles, _Doubles]:
        """Distances in m, shape (N,), and K_c with the lamps on in 8-bit counts, shape (N, 3)."""
    @property
    def contrast_off(self) -> Tuple[_Doubles, _Doubles]:
        """Distances in m, shape (N,), and K_c with the lamps off in 8-bit counts, shape (N, 3)."""
    @property
    def depth_range_m(self) -> Tuple[float, float]:
        """Smallest and largest calibrated depth, m."""
    @property
    def distance_range_m(self) -> Tuple[float, float]:
        """Smallest and largest distance calibrated with lamps on and off, m."""
    @property
    def warnings(self) -> List[str]:
        """What should be known of it, a sentence each."""

@final
class Water:
    """A water file (uw-water/1): what predictions by physics need."""

    @classmethod
    def from_file(cls, file: _Path) -> Water:
        """Reads a water file."""
    def to_json(self) -> str:
        """The JSON text of its file."""
    def write(self, file: _Path) -> None:
        """Writes its file, whole or not at all."""
    @property
    def a_per_m(self) -> List[float]:
        """Absorption (R, G, B), 1/m."""
    @property
    def b_per_m(self) -> List[float]:
        """Scattering (R, G, B), 1/m."""
    @property
    def backscatter_fraction(self) -> float:
        """Share of the scattered light that is turned by more than 90 degrees, in [0, 1]."""
    @property
    def not_identified(self) -> List[str]:
        """Names of fitted numbers that the pictures do not tell."""
    @property
    def warnings(self) -> List[str]:
        """What should be known of it, a sentence each."""

@final
class Answers:
    """Answers requests of the daemon's protocol."""

    def __new__(
        cls,
        model: Optional[_Path],
        water: Optional[Water],
        profile: Optional[Profile],
        *,
        camera: Optional[_Path],
        mask: Optional[_Path],
    ) -> Answers: ...
    def reply(self, line: str) -> str:
        """The daemon's reply to a line."""

def render(
    scene: Scene,
    *,
    spp: Optional[int],
    backend: str,
    layers: Sequence[str],
    seed: int,
    adapter: Optional[str],
    threads: Optional[int],
    max_bounces: Optional[int],
    target_error: Optional[float],
    time_limit_s: Optional[float],
    denoise: bool,
) -> Tuple[Dict[str, _Radiance], str]: ...
def irradiance(
    scene: Scene,
    depths_m: Sequence[float],
    *,
    samples: int,
    seed: int,
    backend: str,
    adapter: Optional[str],
    threads: Optional[int],
) -> Dict[str, _Doubles]: ...
def expose(image: _Radiance, scene: Optional[Scene], seed: int) -> npt.NDArray[Any]: ...
def save(file: _Path, image: npt.NDArray[Any]) -> None: ...
def contrast_of_counts(image: _Doubles) -> List[float]: ...
class Camera:
    """What is known of the camera that took pictures."""

    def __new__(cls, vehicle: Optional[str], encoding: Optional[str], noise: _Noise) -> Camera: ...

def measure_file(file: _Path, camera: Camera) -> str: ...
def measure_rgb8(image: npt.NDArray[np.uint8], camera: Camera) -> str: ...
def measure_rgb16(image: npt.NDArray[np.uint16], camera: Camera) -> str: ...
def encode_png(image: npt.NDArray[np.uint8]) -> bytes: ...
def calibrate(
    manifest: _Path,
    *,
    vehicle: Optional[str],
    light_pct: Optional[float],
    encoding: Optional[str],
    noise: _Noise,
    camera: Optional[_Path],
    mask: Optional[_Path],
    exposure: Optional[float],
    jerlov: Optional[str],
    kd_per_m: Optional[Sequence[float]],
    backscatter_fraction: float,
) -> Profile: ...
def fit(
    manifest: _Path,
    *,
    vehicle: str,
    encoding: Optional[str],
    camera: Optional[_Path],
    mask: Optional[_Path],
    exposure: Optional[float],
    dark: bool,
    bottom: bool,
    backscatter_fraction: float,
    backscatter_error: float,
    gain_error: float,
    jerlov: bool,
    depths_m: Sequence[float],
    kilo_paths: int,
    table_kilo_paths: int,
    seed: int,
    report: Optional[_Path],
) -> Water: ...
