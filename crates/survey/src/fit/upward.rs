//! K_z of a fitted water beside that of the calibration's pictures that look up. Daylight is not fitted to: that they agree is a test of
//! absorption and scattering, made with other light from elsewhere.

use std::sync::atomic::AtomicBool;

use uw_calib::{DepthMeasurement, relative_to_shallowest};
use uw_render::scene::{Exposure, Sensor};

use super::{Fit, Options};
use uw_calib::vehicle::Vehicle;
use uw_twin::measure::{Quality, RenderedView};
use uw_twin::routine::{RoutineError, UP_SAMPLES, look_up_in};

/// Steps in which the exposure is halved in on that makes the shallowest picture as bright as it is.
const STEPS: u32 = 30;
/// Reflectance of the target beside the vehicle, which pictures that look up do not show.
const REFLECTANCE: f32 = 0.2;

/// K_z at a depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedDepth {
    /// Depth, m.
    pub depth_m: f64,
    /// Mean counts over those of the shallowest picture, per channel, measured and in the fitted water.
    pub k_z: [[f64; 2]; 3],
}

/// K_z at the depths of the pictures that look up, by rising depth; none where there are no such pictures. Rendered for the sun and sky of
/// `vehicle`, as bright as the shallowest picture has them.
///
/// # Errors
/// The shallowest picture is black, or a render fails.
pub fn depths(
    fit: &Fit,
    vehicle: &Vehicle,
    options: &Options,
) -> Result<Vec<FittedDepth>, RoutineError> {
    if fit.up.is_empty() {
        return Ok(Vec::new());
    }
    let measured = relative_to_shallowest(&fit.up)?;
    let water = fit.known_water(options, REFLECTANCE);
    let depths_m: Vec<f64> = measured.iter().map(|sample| sample.depth_m).collect();
    let quality = Quality {
        samples_per_half: UP_SAMPLES,
        seed: options.seed,
        threads: None,
    };
    let vehicle = vehicle.in_three_bands();
    let (sensor, views) = look_up_in(
        &vehicle,
        &depths_m,
        quality,
        &AtomicBool::new(false),
        |vehicle, view| Ok::<_, RoutineError>(water.scene_of(vehicle, view)?),
    )?;
    let brightest = shallowest(&fit.up);
    let made = [0, 1, 2].map(|k| {
        let sensor = as_bright(&sensor, &views[0].1, k, brightest[k]);
        let mean = |view: &RenderedView| view.statistics(&sensor, 0.0).mean[k];
        let first = mean(&views[0].1);
        views
            .iter()
            .map(|(_, view)| mean(view) / first)
            .collect::<Vec<f64>>()
    });
    let rows = measured.iter().enumerate();
    Ok(rows
        .map(|(i, sample)| FittedDepth {
            depth_m: sample.depth_m,
            k_z: [0, 1, 2].map(|k| [sample.k_z[k], made[k][i]]),
        })
        .collect())
}

/// Mean counts of the shallowest pictures.
fn shallowest(up: &[DepthMeasurement]) -> [f64; 3] {
    let least = up.iter().map(|m| m.depth_m).fold(f64::INFINITY, f64::min);
    let first: Vec<&DepthMeasurement> = up.iter().filter(|m| m.depth_m == least).collect();
    let n = first.len() as f64;
    [0, 1, 2].map(|k| first.iter().map(|m| m.mean[k]).sum::<f64>() / n)
}

/// The sensor with the exposure at which `view` has `counts` in channel `k`.
fn as_bright(sensor: &Sensor, view: &RenderedView, k: usize, counts: f64) -> Sensor {
    let of = |ln_exposure: f64| Sensor {
        exposure: Exposure::Fixed(ln_exposure.exp()),
        ..*sensor
    };
    // From next to black to next to white.
    let (mut low, mut high) = (-14f64, 14f64);
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        match view.statistics(&of(middle), 0.0).mean[k] < counts {
            true => low = middle,
            false => high = middle,
        }
    }
    of(0.5 * (low + high))
}
