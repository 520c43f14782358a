//! The calibration routine: which views it takes, and the profile they give.

use std::sync::atomic::AtomicBool;

use uw_calib::{CalibrateError, ContrastMeasurement, DepthMeasurement, Profile, Source};
use uw_render::integrator::RenderError;
use uw_render::scene::{Exposure, Scene, Sensor};

use crate::environment::{EnvironmentError, Target, View, WaterBody, scene, sensor};
use crate::measure::{Quality, RenderedView};
use uw_calib::vehicle::Vehicle;

/// Depths of the images that look up, m.
pub const UP_DEPTHS_M: [f64; 6] = [0.5, 1.0, 2.0, 3.0, 4.0, 6.0];
/// Distances of the images of the target, m.
pub const DISTANCES_M: [f64; 6] = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0];
/// Depth of the images of the target, m.
pub const CONTRAST_DEPTH_M: f64 = 3.0;
/// Lamp level of the contrast profile with the lamps on, percent: that of the data the shipped models learnt from.
pub const CONTRAST_LIGHT_PCT: f64 = 67.0;
/// Samples per pixel of each half of an image that looks up.
pub const UP_SAMPLES: u32 = 64;
/// Paths per group of a [`TargetImage`](crate::estimate::target_image::TargetImage).
pub const TARGET_PATHS: u32 = 2048;
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

/// Images that look up in `water` at `depths_m` (increasing), one exposure for all, set at the shallowest.
///
/// # Errors
/// The environment is not valid, or a render failed or was stopped.
pub fn look_up(
    vehicle: &Vehicle,
    water: &WaterBody,
    target: &Target,
    depths_m: &[f64],
    quality: Quality,
    cancel: &AtomicBool,
) -> Result<(Sensor, Vec<(f64, RenderedView)>), RoutineError> {
    look_up_in(vehicle, depths_m, quality, cancel, |vehicle, view| {
        Ok(scene(vehicle, water, target, view)?)
    })
}

/// The same in scenes that `scene_of` makes for a vehicle (this one, with a smaller camera) and a view.
///
/// # Errors
/// `scene_of` fails, or a render failed or was stopped.
pub fn look_up_in<E: From<RenderError>>(
    vehicle: &Vehicle,
    depths_m: &[f64],
    quality: Quality,
    cancel: &AtomicBool,
    mut scene_of: impl FnMut(&Vehicle, View) -> Result<Scene, E>,
) -> Result<(Sensor, Vec<(f64, RenderedView)>), E> {
    let upwards = Vehicle {
        width: UP_SIZE.0,
        height: UP_SIZE.1,
        ..vehicle.clone()
    };
    let mut sensor = sensor(vehicle, 1.0);
    let mut views = Vec::new();
    for (i, &depth_m) in depths_m.iter().enumerate() {
        let scene = scene_of(&upwards, View::Up { depth_m })?;
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
