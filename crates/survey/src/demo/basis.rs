//! What the demonstration's daemon predicts with: a network for the vehicle that it was trained for, physics for any other.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use uw_guidance::Model;
use uw_guidance::physics::Water;
use uw_guidance::service::Basis;

use super::stages::{VISITS, write_text};
use super::{DemoError, DemoOptions};
use crate::fit::{self, FitError, WaterError, water_file};
use uw_calib::vehicle::Vehicle;

/// Paths of the water's tables per view, source and group.
const TABLE_PATHS: u32 = 8192;
/// Where the fitted water is written, in the demonstration's folder.
const WATER_FILE: &str = "water.json";

/// A basis with what the report calls it.
pub(super) struct Predictor {
    pub(super) basis: Basis,
    pub(super) name: String,
}

/// How the demonstration will predict, known before anything is rendered.
pub(super) enum Way {
    /// By this network.
    Network { model: Box<Model>, path: PathBuf },
    /// By physics, in a water that the calibration's pictures tell.
    Physics,
}

impl Way {
    /// The model that is asked for; without one the shipped one, where it is of this vehicle.
    pub(super) fn of(options: &DemoOptions) -> Result<Self, DemoError> {
        let path = options.model.clone();
        let path = path.unwrap_or_else(|| uw_assets::DEFAULT_MODEL.into());
        let model = Model::read(&path).map_err(|e| DemoError::Input(e.to_string()))?;
        Ok(
            match options.model.is_some() || suits(&model, &options.vehicle) {
                true => Self::Network {
                    model: Box::new(model),
                    path,
                },
                false => Self::Physics,
            },
        )
    }

    /// The predictor, from the calibration's pictures in `folder` where it needs them.
    pub(super) fn predictor(
        self,
        options: &DemoOptions,
        down: bool,
        folder: &Path,
        cancel: &AtomicBool,
    ) -> Result<Predictor, DemoError> {
        match self {
            Self::Network { model, path } => Ok(Predictor {
                basis: Basis::Network(model),
                name: path
                    .file_name()
                    .map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            }),
            Self::Physics => Ok(Predictor {
                basis: Basis::Physics(Arc::new(fitted(options, down, folder, cancel)?)),
                name: WATER_FILE.to_owned(),
            }),
        }
    }
}

/// Whether a model was made for this vehicle's camera and lamps.
fn suits(model: &Model, vehicle: &Vehicle) -> bool {
    let rig = vehicle.rig(Some(vehicle.exposure));
    vehicle.encoding == uw_calib::Encoding::Srgb && model.card().rig.differences(&rig).is_empty()
}

/// The water that the calibration's pictures tell, written to the demonstration's folder.
fn fitted(
    options: &DemoOptions,
    down: bool,
    folder: &Path,
    cancel: &AtomicBool,
) -> Result<Water, DemoError> {
    let of_fit = fit::Options {
        encoding: options.vehicle.encoding,
        down,
        depths_m: VISITS.map(|(depth_m, ..)| depth_m).to_vec(),
        seed: options.seed,
        ..fit::Options::default()
    };
    let goes_on = |_, _| !cancel.load(Ordering::Relaxed);
    let manifest = folder.join("calibration/manifest.csv");
    let found = fit::fit(&manifest, &options.vehicle, &of_fit, &goes_on)?;
    let made_by = concat!("uw demo ", env!("CARGO_PKG_VERSION"));
    let goes_on = |_| !cancel.load(Ordering::Relaxed);
    let of = (TABLE_PATHS, made_by);
    let file = water_file(&found, &options.vehicle, &of_fit, of, goes_on);
    let file = file.map_err(|error| match error {
        WaterError::Interrupted => DemoError::Interrupted,
        other => DemoError::Water(other.to_string()),
    })?;
    write_text(&folder.join(WATER_FILE), &file.to_json())?;
    Ok(Water::new(file))
}

impl From<FitError> for DemoError {
    fn from(error: FitError) -> Self {
        match error {
            FitError::Interrupted => Self::Interrupted,
            other => Self::Water(format!(
                "no water can be fitted to the calibration's pictures: {other}"
            )),
        }
    }
}
