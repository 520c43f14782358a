"""Pictures and irradiances of scenes."""

import json
from typing import Any, Dict, Mapping, Optional, Sequence, Union

import numpy as np

from . import _native
from ._arguments import PathLike, SceneLike, names_of, pixels_of, radiance_of, scene_of, told


class Layers(Dict[str, np.ndarray]):
    """What :func:`render` returns: arrays by the names of layers, and facts about the render.

    ``stats`` has, among others, ``samples_per_pixel``, ``relative_error`` (estimated, of the picture; None where too little is
    known), ``backend``, ``adapter``, ``seed``, ``setup_s``, ``render_s``, ``filled_pixels`` and, where it was denoised,
    ``denoised``; they are those of ``uw render --stats``.
    """

    stats: Dict[str, Any]

    def __init__(self, arrays: Mapping[str, np.ndarray], stats: Dict[str, Any]):
        super().__init__(arrays)
        self.stats = stats


def render(
    scene: SceneLike,
    *,
    spp: Optional[int] = 64,
    backend: str = "auto",
    layers: Union[str, Sequence[str]] = (),
    seed: int = 0,
    adapter: Optional[str] = None,
    threads: Optional[int] = None,
    max_bounces: Optional[int] = None,
    target_error: Optional[float] = None,
    time_limit_s: Optional[float] = None,
    denoise: bool = False,
) -> Layers:
    """Renders a scene: what ``uw render`` writes to an EXR, as arrays.

    The interpreter's lock is free meanwhile, so that other threads run. Ctrl-C in the main thread ends it within a batch and raises
    ``KeyboardInterrupt``. The arrays are the renderer's own memory, not copies. The same scene, seed and backend give the same
    values, whatever the number of threads.

    Args:
        scene: a :class:`Scene`, the path of a scene file, the name of a shipped scene, or a dictionary (:meth:`Scene.from_dict`).
        spp: samples per pixel, 1 to 2^30; None for the scene's, or for no limit with `target_error` or `time_limit_s`.
        backend: "auto" (a GPU where there is one, else the processor's vector units), "cpu" (double precision), "cpu-simd" or
            "gpu" (single precision).
        layers: layers beside the picture: "ambient", "lamp.NAME" (at 100 %), "lamps", "direct", "backscatter" in W/(m² sr),
            "depth" in m along the optical axis (infinite where nothing is), "normal" (unit vectors, world), "reflectance",
            "transmittance" in [0, 1], "variance" of the pixel means, "all".
        seed: of all random numbers, 0 to 2^64 - 1.
        adapter: graphics adapter, any part of its name.
        threads: worker threads, 1 to 1024; None for one per core.
        max_bounces: most scatterings and reflections of a path, 0 for no limit; None for the scene's.
        target_error: stop when the estimated relative error of the picture is at most this, > 0.
        time_limit_s: stop after this time, s, > 0; where it does not last for every pixel the picture is coarse, with a warning.
        denoise: take the noise off (biased, docs/denoise.md); `spp` must be even.

    Returns:
        "image", the picture (radiance in W/(m² sr)), then the layers: float32 of shape (height, width, 3), "depth" of shape
        (height, width). ``.stats`` has facts.

    Raises:
        ValueError: a scene, layer, backend or number that cannot be used, or a render that failed.
    """
    arrays, stats = _native.render(
        scene_of(scene),
        spp=spp,
        backend=backend,
        layers=names_of(layers),
        seed=seed,
        adapter=adapter,
        threads=threads,
        max_bounces=max_bounces,
        target_error=target_error,
        time_limit_s=time_limit_s,
        denoise=denoise,
    )
    return Layers(arrays, json.loads(stats))


def irradiance(
    scene: SceneLike,
    depths_m: Union[float, Sequence[float], np.ndarray],
    *,
    samples: int = 65_536,
    seed: int = 0,
    backend: str = "auto",
    adapter: Optional[str] = None,
    threads: Optional[int] = None,
) -> Dict[str, np.ndarray]:
    """Irradiances at depths below the water surface, at the camera's horizontal position: ``uw irradiance``.

    Args:
        scene: as of :func:`render`; it needs water and a surface.
        depths_m: one depth or several, m, >= 0; 0 is just below the surface.
        samples: directions per depth and hemisphere, 2 to 2^30.
        seed: of all random numbers.
        backend: as of :func:`render`.
        adapter: graphics adapter, any part of its name.
        threads: worker threads; None for one per core.

    Returns:
        "depth_m" of shape (N,), and of shape (N, 3) "E_d" and "E_u" (plane irradiance downwards and upwards), "E_od" and "E_ou"
        (scalar), all W/m², and "L_u" (radiance straight up, W/(m² sr)), each with its NAME_standard_error; float64.

    Raises:
        ValueError: a scene without a surface, or numbers that cannot be used.
    """
    depths = np.atleast_1d(np.asarray(depths_m, dtype=np.float64))
    if depths.ndim != 1:
        raise ValueError(f"depths_m must be a number or a list of numbers, got {told(depths)}")
    return _native.irradiance(
        scene_of(scene),
        depths.tolist(),
        samples=samples,
        seed=seed,
        backend=backend,
        adapter=adapter,
        threads=threads,
    )


def expose(image: np.ndarray, scene: Optional[SceneLike] = None, *, seed: int = 0) -> np.ndarray:
    """What a scene's sensor stores of radiance: exposure, noise, white balance, encoding, rounding; ``uw sensor``.

    Args:
        image: radiance in W/(m² sr), floats of shape (height, width, 3), as ``render(..)["image"]``.
        scene: whose ``[sensor]`` is applied, as of :func:`render`; the default sensor where it has none, and for None.
        seed: of the noise.

    Returns:
        uint8 of shape (height, width, 3), or uint16 where the sensor has 16 bits.
    """
    return _native.expose(radiance_of(image), None if scene is None else scene_of(scene), seed)


def save(file: PathLike, image: np.ndarray) -> None:
    """Writes a picture, whole or not at all: uint8 or uint16 to ``.png`` or ``.tif``, float32 radiance to ``.exr``.

    Raises:
        ValueError: another kind of file or array, or a file that cannot be written.
    """
    array = np.asarray(image)
    array = radiance_of(array) if array.dtype.kind == "f" else pixels_of(array)
    if array.dtype not in (np.uint8, np.uint16, np.float32):
        raise ValueError(f"image must be uint8, uint16 or float32, got {array.dtype}")
    _native.save(file, array)
