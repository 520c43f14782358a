"""Profiles and waters from the pictures of a calibration."""

import os
from typing import Optional, Sequence

from . import _native
from ._arguments import PathLike, noise_of
from ._native import Profile, Water


def calibrate(
    manifest: PathLike,
    *,
    vehicle: Optional[PathLike] = None,
    light_pct: Optional[float] = None,
    encoding: Optional[str] = None,
    noise_a: Optional[float] = None,
    noise_b: Optional[float] = None,
    camera: Optional[PathLike] = None,
    mask: Optional[PathLike] = None,
    exposure: Optional[float] = None,
    jerlov: Optional[str] = None,
    kd_per_m: Optional[Sequence[float]] = None,
    backscatter_fraction: float = 0.0183,
) -> Profile:
    """Makes a profile of the pictures of a manifest: ``uw calibrate``.

    Args:
        manifest: CSV table ``file,kind,depth_m,distance_m,light_pct``; kind "depth" looks straight up, "contrast" at the target.
        vehicle: vehicle that took them, a name among the shipped ones or a file (\\*.toml): its encoding and noise serve where they are
            not given, its vignetting is taken out of the pictures, its level curve is that of the column `level_pct`.
        light_pct: lamp level of K_c on, percent, above 0 and at most 100; by default that with pictures from the most distances.
        encoding: how the camera's counts stand for light, "srgb" or "linear"; None for the vehicle's, "srgb" without one.
        noise_a: noise of the camera: the variance of a linear signal y in [0, 1] is noise_a y + noise_b; without it that of the
            vehicle, without one it is found in the pictures.
        noise_b: see `noise_a`.
        camera: camera that took the pictures: a scene file whose ``[camera]`` has their size, lens and port, or a calibration (``*.yaml``, ``*.xml``) of ROS, OpenCV, Kalibr or Metashape. They are measured as the ideal
            camera of `vehicle` would have taken them.
        mask: what of the pictures is not the target: polygons (\\*.toml, uw-mask/1) or a picture whose dark pixels are left out.
        exposure: that the pictures of the target are brought to in linear light: time in seconds · ISO / f-number², as EXIF has it, or in
            the unit of the manifest's column `exposure`; None for that of the shortest.
        jerlov: without pictures that look up, K_z of this water type (or a mixture, "IB-II@0.4"), rendered.
        kd_per_m: without pictures that look up, K_z of the water with this diffuse attenuation of daylight, 1/m, three numbers > 0.
        backscatter_fraction: of the water that is rendered, in (0, 0.5).

    Returns:
        A :class:`Profile`; what should be known of it is in its ``warnings``, and warned of.

    Raises:
        ValueError: a manifest or picture that cannot be used; the text names file and line.
    """
    return _native.calibrate(
        manifest,
        vehicle=None if vehicle is None else os.fspath(vehicle),
        light_pct=light_pct,
        encoding=encoding,
        noise=noise_of(noise_a, noise_b),
        camera=None if camera is None else os.fspath(camera),
        mask=None if mask is None else os.fspath(mask),
        exposure=exposure,
        jerlov=jerlov,
        kd_per_m=None if kd_per_m is None else [float(k) for k in kd_per_m],
        backscatter_fraction=backscatter_fraction,
    )


def fit(
    manifest: PathLike,
    *,
    vehicle: PathLike = "default",
    encoding: Optional[str] = None,
    camera: Optional[PathLike] = None,
    mask: Optional[PathLike] = None,
    exposure: Optional[float] = None,
    dark: bool = False,
    bottom: bool = False,
    backscatter_fraction: float = 0.0183,
    backscatter_error: float = 0.6,
    gain_error: float = 0.5,
    jerlov: bool = False,
    depths_m: Sequence[float] = (),
    kilo_paths: int = 64,
    table_kilo_paths: int = 128,
    seed: int = 1,
    report: Optional[PathLike] = None,
) -> Water:
    """Fits water and lamps to the pictures of a calibration and makes the tables of predictions by physics: ``uw fit``.

    Takes minutes with the default numbers of paths; Ctrl-C ends the fit.

    Args:
        manifest: as of :func:`calibrate`, with pictures from three distances or more, lamps on and off.
        vehicle: vehicle that took them: a name among the shipped ones, or a file (\\*.toml).
        encoding: how counts stand for light, "srgb" or "linear"; None for the vehicle's.
        camera: as of :func:`calibrate`.
        mask: as of :func:`calibrate`.
        exposure: as of :func:`calibrate`.
        dark: there is no daylight: one picture from each distance, with the lamps on, will do, and the water file holds at any depth.
        bottom: the vehicle looks down at the bottom rather than ahead at a wall.
        backscatter_fraction: that is expected.
        backscatter_error: how well, as a relative error in (0, 3].
        gain_error: how well the vehicle's file knows its lamps' intensity times exposure, as a relative error in (0, 3].
        jerlov: the water is between two neighbouring ones of Jerlov's types.
        depths_m: depths that the water file is for besides those of the pictures, m, in [0.1, 60]; without them a metre around.
        kilo_paths: paths per distance of the fit, in thousands, 4 to 1024.
        table_kilo_paths: paths per view and source of the tables, in thousands, 8 to 8192.
        seed: of all random numbers.
        report: folder for a report with plots.

    Returns:
        A :class:`Water`; its ``not_identified`` names what the pictures do not tell.

    Raises:
        ValueError: a manifest or picture that cannot be used, or no water that comes close to the pictures.
    """
    return _native.fit(
        manifest,
        vehicle=str(vehicle),
        encoding=encoding,
        camera=None if camera is None else os.fspath(camera),
        mask=None if mask is None else os.fspath(mask),
        exposure=exposure,
        dark=dark,
        bottom=bottom,
        backscatter_fraction=backscatter_fraction,
        backscatter_error=backscatter_error,
        gain_error=gain_error,
        jerlov=jerlov,
        depths_m=list(depths_m),
        kilo_paths=kilo_paths,
        table_kilo_paths=table_kilo_paths,
        seed=seed,
        report=report,
    )
