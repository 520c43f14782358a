//! Calibration from pictures.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use pyo3::prelude::*;
use uw_calib::{Calibration, Daylight, RoutineOptions, Treatment, from_manifest};
use uw_survey::treatment::{Photographs, distances_m};
use uw_twin::daylight::{Known, attenuation, stand_in};
use uw_twin::environment::JerlovWater;

use crate::camera::Camera;
use crate::errors::{value_error, warn};
use crate::interrupt::interruptible;
use crate::numbers::number;
use crate::profile::Profile;

const MADE_BY: &str = concat!("uwguide.calibrate ", env!("CARGO_PKG_VERSION"));

/// Makes a profile of the pictures of a manifest. See ``uwguide.calibrate``.
#[pyfunction]
#[pyo3(signature = (manifest, *, vehicle, light_pct, encoding, noise, camera, mask, exposure, jerlov, kd_per_m, backscatter_fraction))]
#[expect(
    clippy::too_many_arguments,
    reason = "the keywords of uwguide.calibrate"
)]
pub(crate) fn calibrate(
    py: Python<'_>,
    manifest: PathBuf,
    vehicle: Option<&str>,
    light_pct: Option<&Bound<'_, PyAny>>,
    encoding: Option<&str>,
    noise: Option<(f64, f64)>,
    camera: Option<PathBuf>,
    mask: Option<PathBuf>,
    exposure: Option<&Bound<'_, PyAny>>,
    jerlov: Option<&str>,
    kd_per_m: Option<Vec<f64>>,
    backscatter_fraction: f64,
) -> PyResult<Profile> {
    let expected = "above 0 and at most 100";
    let level = |given| number("light_pct", given, expected, |v| v > 0.0 && v <= 100.0);
    let photographs = Photographs { camera, mask };
    let camera = Camera::new(vehicle, encoding, noise)?;
    let vehicle = camera.vehicle.as_ref();
    let known = match (jerlov, kd_per_m) {
        (Some(_), Some(_)) => {
            return Err(value_error("jerlov and kd_per_m must not be given both"));
        }
        (Some(jerlov), None) => {
            let parsed = jerlov.parse::<JerlovWater>();
            Known::Jerlov(parsed.map_err(|e| value_error(format_args!("jerlov: {e}")))?)
        }
        (None, Some(k_d)) => {
            let checked = attenuation(&k_d);
            Known::Attenuation(checked.map_err(|e| value_error(format_args!("kd_per_m {e}")))?)
        }
        (None, None) => Known::Nothing,
    };
    let known_camera = (vehicle, camera.even, camera.encoding);
    let treated = photographs.treatment(known_camera, &distances_m(&manifest, vehicle));
    let (treatment, doubts) = treated.map_err(value_error)?;
    warn(py, 2, &doubts)?;
    let options = RoutineOptions {
        light_pct: light_pct.map(level).transpose()?,
        levels: vehicle.and_then(|vehicle| vehicle.level_curve.clone()),
        rig: vehicle
            .map(|vehicle| vehicle.rig(Some(vehicle.exposure)))
            .unwrap_or_default(),
        treatment: Treatment {
            exposure: exposure.map(self::exposure).transpose()?,
            ..treatment
        },
        noise: camera.noise,
        daylight: Daylight::Pictures,
    };
    let made = interruptible(py, None, |cancel| {
        make(&manifest, known, backscatter_fraction, options, cancel)
    })?;
    let Calibration { profile, warnings } = made.map_err(value_error)?;
    warn(py, 2, &warnings)?;
    Ok(Profile::new(profile, warnings))
}

/// The exposure that pictures are brought to.
pub(crate) fn exposure(given: &Bound<'_, PyAny>) -> PyResult<f64> {
    let expected = "finite and above 0";
    number("exposure", given, expected, |e| e > 0.0 && e.is_finite())
}

fn make(
    manifest: &Path,
    known: Known,
    backscatter_fraction: f64,
    mut options: RoutineOptions,
    cancel: &AtomicBool,
) -> Result<Calibration, String> {
    let stand = stand_in(manifest, &options, known).map_err(|e| e.to_string())?;
    if let Some(stand) = stand {
        let rendered = stand.render(backscatter_fraction, cancel);
        options.daylight = rendered.map_err(|e| e.to_string())?;
    }
    from_manifest(manifest, MADE_BY, &options).map_err(|e| e.to_string())
}
