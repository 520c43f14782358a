//! Water from the pictures of a calibration.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use pyo3::prelude::*;
use uw_calib::response::LinearNoise;
use uw_calib::vehicle::{Vehicle, VehicleFile};
use uw_calib::{Encoding, Manifest, NoiseModel, SensorNoise, processing};
use uw_guidance::physics::WaterFile;
use uw_survey::fit::{self as fitting, Options};
use uw_survey::treatment::{Photographs, distances_m};

use crate::errors::{value_error, warn};
use crate::interrupt::interruptible;
use crate::numbers::{seed, whole};
use crate::water::Water;
use crate::{calibrate, camera};

const MADE_BY: &str = concat!("uwguide.fit ", env!("CARGO_PKG_VERSION"));

/// What is fitted, and how.
struct Task {
    manifest: PathBuf,
    vehicle: Vehicle,
    options: Options,
    report: Option<PathBuf>,
    paths_per_group: u32,
}

/// Fits the water and makes its tables. See ``uwguide.fit``.
#[pyfunction]
#[pyo3(signature = (manifest, *, vehicle, encoding, camera, mask, exposure, dark, bottom, backscatter_fraction, backscatter_error, gain_error, jerlov, depths_m,
    kilo_paths, table_kilo_paths, seed, report))]
#[expect(clippy::too_many_arguments, reason = "the keywords of uwguide.fit")]
pub(crate) fn fit(
    py: Python<'_>,
    manifest: PathBuf,
    vehicle: &str,
    encoding: Option<&str>,
    camera: Option<PathBuf>,
    mask: Option<PathBuf>,
    exposure: Option<&Bound<'_, PyAny>>,
    dark: bool,
    bottom: bool,
    backscatter_fraction: f64,
    backscatter_error: f64,
    gain_error: f64,
    jerlov: bool,
    depths_m: Vec<f64>,
    kilo_paths: &Bound<'_, PyAny>,
    table_kilo_paths: &Bound<'_, PyAny>,
    seed: &Bound<'_, PyAny>,
    report: Option<PathBuf>,
) -> PyResult<Water> {
    let VehicleFile { vehicle, .. } =
        VehicleFile::find(vehicle, Path::new("")).map_err(value_error)?;
    let encoding = encoding.map_or(Ok(vehicle.encoding), self::camera::encoding)?;
    let photographs = Photographs { camera, mask };
    let distances_m = distances_m(&manifest, Some(&vehicle));
    let treated = photographs.treatment((Some(&vehicle), None, encoding), &distances_m);
    let (treatment, doubts) = treated.map_err(value_error)?;
    warn(py, 2, &doubts)?;
    let options = Options {
        encoding,
        exposure: exposure.map(calibrate::exposure).transpose()?,
        mask: treatment.mask,
        undistortion: treatment.undistortion,
        dark,
        down: bottom,
        backscatter_fraction,
        backscatter_error,
        gain_error,
        jerlov,
        depths_m,
        paths: 1024 * whole("kilo_paths", kilo_paths, 4..=1024_u32)? as usize,
        seed: self::seed(seed)?,
    };
    if let Some((field, wrong)) = options.wrong() {
        return Err(value_error(format_args!("{field} {wrong}")));
    }
    let task = Task {
        manifest,
        vehicle,
        options,
        report,
        paths_per_group: 128 * whole("table_kilo_paths", table_kilo_paths, 8..=8192_u32)?,
    };
    warn(py, 2, task.doubts())?;
    let made = interruptible(py, None, |cancel| task.run(cancel))?;
    let (file, warnings) = made.map_err(value_error)?;
    warn(py, 2, &warnings)?;
    Water::new(&file, warnings)
}

impl Task {
    /// What the pictures may not be good for.
    fn doubts(&self) -> Vec<String> {
        let mut doubts = Vec::new();
        let noise = LinearNoise {
            a: self.vehicle.noise_a,
            b: self.vehicle.noise_b,
        };
        let encoding: Encoding = self.options.encoding;
        let sensor = SensorNoise::new(encoding, noise).map(NoiseModel::Sensor);
        // A manifest that cannot be read is the fit's to refuse.
        let manifest = Manifest::parse(&self.manifest, self.vehicle.level_curve.as_ref());
        if let (Ok(manifest), Some(sensor)) = (manifest, sensor) {
            doubts.extend(processing::warnings_of(&manifest, &sensor));
        }
        doubts
    }

    fn run(&self, cancel: &AtomicBool) -> Result<(WaterFile, Vec<String>), String> {
        let goes_on = |_: usize, _: usize| !cancel.load(Ordering::Relaxed);
        let found = fitting::fit(&self.manifest, &self.vehicle, &self.options, &goes_on);
        let found = found.map_err(|error| error.to_string())?;
        if let Some(folder) = &self.report {
            let depths = fitting::depths(&found, &self.vehicle, &self.options);
            let depths = depths.map_err(|error| error.to_string())?;
            fitting::report(&found, &depths, folder).map_err(|error| error.to_string())?;
        }
        let (options, paths) = (&self.options, self.paths_per_group);
        let goes_on = |_| !cancel.load(Ordering::Relaxed);
        let of = (paths, MADE_BY);
        let file = fitting::water_file(&found, &self.vehicle, options, of, goes_on);
        Ok((file.map_err(|error| error.to_string())?, found.warnings))
    }
}
