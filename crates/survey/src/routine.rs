//! The calibration routine: which views it takes, and the profile they give.

use std::sync::atomic::AtomicBool;

use uw_calib::{CalibrateError, ContrastMeasurement, DepthMeasurement, Profile, Source};
use uw_render::integrator::RenderError;
use uw_render::scene::{Exposure, Sensor};

use crate::environment::{EnvironmentError, Target, View, WaterBody, scene, sensor};
use crate::measure::{Quality, RenderedView};
use crate::vehicle::Vehicle;

/// Size of the images that look up, pixels: only their mean counts.
const UP_SIZE: (u32, u32) = (64, 36);

/// A calibration cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum RoutineError {
    /// The environment is not valid.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// A render failed or was stopped.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The measurements make no profile.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
}

/// Images that look up at `depths_m` (increasing), one exposure for all, set at the shallowest.
pub fn look_up(
    vehicle: &Vehicle,
    water: &WaterBody,
    target: &Target,
    depths_m: &[f64],
    quality: Quality,
    cancel: &AtomicBool,
) -> Result<(Sensor, Vec<(f64, RenderedView)>), RoutineError> {
    let upwards = Vehicle {
        width: UP_SIZE.0,
        height: UP_SIZE.1,
        ..vehicle.clone()
    };
    let mut sensor = sensor(vehicle, 1.0);
    let mut views = Vec::new();
    for (i, &depth_m) in depths_m.iter().enumerate() {
        let scene = scene(&upwards, water, target, View::Up { depth_m })?;
        let quality = Quality {
            seed: quality.seed.wrapping_add(i as u64),
            ..quality
        };
        let view = RenderedView::render(&scene, quality, cancel)?;
        if i == 0 {
            sensor.exposure = Exposure::AutoMean(vehicle.up_mean);
            sensor.exposure = Exposure::Fixed(view.exposure(&sensor, 0.0));
        }
        views.push((depth_m, view));
    }
    Ok((sensor, views))
}

/// Depth measurements of images that look up.
pub fn measure_depths(sensor: &Sensor, views: &[(f64, RenderedView)]) -> Vec<DepthMeasurement> {
    views
        .iter()
        .map(|(depth_m, view)| DepthMeasurement {
            depth_m: *depth_m,
            mean: view.statistics(sensor, 0.0).mean,
        })
        .collect()
}

/// The profile of measurements made by `made_by`.
pub fn profile(
    depth: &[DepthMeasurement],
    contrast: &[ContrastMeasurement],
    made_by: &str,
) -> Result<Profile, RoutineError> {
    let source = Source {
        made_by: made_by.into(),
        images: (depth.len() + contrast.len()) as u64,
        note: None,
    };
    Ok(Profile::from_measurements(depth, contrast, source)?)
}
