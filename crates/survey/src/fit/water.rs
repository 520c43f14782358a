//! The water file of a fitted water: tables made for it, and the target as the calibration's pictures show it.

use uw_calib::StatsError;
use uw_calib::response::CountResponse;
use uw_guidance::Candidate;
use uw_guidance::physics::file::{FitNumbers, WATER_FORMAT};
use uw_guidance::physics::water::Field;
use uw_guidance::physics::{LinearPicture, Sight, WaterFile, WaterTables};
use uw_media::Iops;
use uw_render::scene::Scene;

use super::daylight::{Daylight, daylight};
use super::pictures::SAME_M;
use super::{Fit, Options};
use uw_calib::vehicle::Vehicle;
use uw_twin::estimate::water_tables::{
    KnownWater, TablePlan, TablesError, sensor_numbers, water_tables_watched,
};

/// Largest ratio of a distance of the tables to the one before: in between they are nearly straight lines.
const MOST_RATIO: f64 = 1.22;
/// Depth that is assumed where no picture has one, m.
pub(super) const SOME_DEPTH_M: f64 = 3.0;
/// How far from a single depth the tables reach, m.
const AROUND_M: f64 = 1.0;
/// Reflectances that a target's may be.
const REFLECTANCES: std::ops::RangeInclusive<f64> = 0.02..=0.8;

/// There is no water file.
#[derive(Debug, thiserror::Error)]
pub enum WaterError {
    /// The tables cannot be made.
    #[error(transparent)]
    Tables(TablesError),
    /// A picture cannot be read.
    #[error(transparent)]
    Picture(#[from] StatsError),
    /// It was interrupted.
    #[error("interrupted")]
    Interrupted,
}

impl From<TablesError> for WaterError {
    fn from(error: TablesError) -> Self {
        match error {
            TablesError::Stopped => Self::Interrupted,
            other => Self::Tables(other),
        }
    }
}

impl Fit {
    /// The water that was found, before a target of the kind of `options` and of a `reflectance`.
    pub(super) fn known_water(&self, options: &Options, reflectance: f32) -> KnownWater {
        KnownWater {
            iops: Iops {
                a: self.a_per_m.map(|a| a.value),
                b: self.b_per_m.map(|b| b.value),
            },
            backscatter_fraction: self.backscatter_fraction.value,
            bottom: options.down,
            reflectance,
        }
    }
}

/// The water file of `fit`, made from pictures of `vehicle`; tables by `paths_per_group` paths a view, source and group. `goes_on` hears what
/// share of them is done and says whether to go on.
///
/// # Errors
/// The tables cannot be made, a picture cannot be read again, or it was to stop.
pub fn water_file(
    fit: &Fit,
    vehicle: &Vehicle,
    options: &Options,
    (paths_per_group, made_by): (u32, &str),
    goes_on: impl Fn(f64) -> bool + Sync,
) -> Result<WaterFile, WaterError> {
    // Water files have three bands.
    let vehicle = &vehicle.in_three_bands();
    let mean = fit.reflectance.iter().sum::<f64>() / 3.0;
    let plan = TablePlan {
        distances_m: distances_m(fit),
        depths_m: match options.dark {
            true => Vec::new(),
            false => depths_m(fit, &options.depths_m),
        },
        reflectance: mean.clamp(*REFLECTANCES.start(), *REFLECTANCES.end()) as f32,
        paths_per_group,
        seed: options.seed,
    };
    let water = fit.known_water(options, plan.reflectance);
    let scene = |depth_m, distance_m| Ok(lit(water.scene(vehicle, depth_m, distance_m)?, fit));
    let mut tables = water_tables_watched(&plan, scene, goes_on)?;
    let daylight = daylight(fit, vehicle, options, &tables)?;
    if let Some(daylight) = &daylight {
        brighten(&mut tables, daylight.gain);
    }
    let mut file = WaterFile {
        format: WATER_FORMAT.to_owned(),
        made_by: made_by.to_owned(),
        water: water.numbers(),
        sensor: sensor_numbers(vehicle, options.encoding),
        tables,
        sights: Vec::new(),
        fit: Some(numbers(fit, daylight.as_ref())),
    };
    file.sights = sights(fit, vehicle, options, &file)?;
    Ok(file)
}

/// The scene of a view, with the lamps as bright as the fit has them.
fn lit(mut scene: Scene, fit: &Fit) -> Scene {
    for lamp in &mut scene.lamps {
        for (intensity, gain) in lamp.intensity.iter_mut().zip(&fit.lamp_gain) {
            *intensity *= gain.value;
        }
    }
    scene
}

/// Distances of the pictures, and others between them.
fn distances_m(fit: &Fit) -> Vec<f64> {
    let mut all: Vec<f64> = Vec::new();
    for place in &fit.places {
        let next_m = place[0].distance_m;
        if let Some(&last_m) = all.last() {
            if next_m - last_m < SAME_M {
                continue;
            }
            let parts = ((next_m / last_m).ln() / MOST_RATIO.ln()).ceil() as i32;
            let ratio = (next_m / last_m).powf(1.0 / f64::from(parts));
            all.extend((1..parts).map(|i| last_m * ratio.powi(i)));
        }
        all.push(next_m);
    }
    all
}

/// Depths of the pictures and those that are asked for; where that is one, others about it: a vehicle does not keep its depth to the
/// centimetre.
fn depths_m(fit: &Fit, asked_m: &[f64]) -> Vec<f64> {
    let mut all: Vec<f64> = fit.places.iter().filter_map(|p| p[0].depth_m).collect();
    all.extend(asked_m);
    all.sort_by(f64::total_cmp);
    all.dedup_by(|a, b| (*a - *b).abs() < SAME_M);
    if all.is_empty() {
        all.push(SOME_DEPTH_M);
    }
    if let &[only] = &all[..] {
        all = vec![(only - AROUND_M).max(0.5 * only), only, only + AROUND_M];
    }
    all
}

fn brighten(tables: &mut WaterTables, gain: [f64; 3]) {
    let multiply = |field: &mut Field| {
        for (values, gain) in field.iter_mut().zip(gain) {
            values.iter_mut().for_each(|value| *value *= gain);
        }
    };
    for source in tables.views.iter_mut().flat_map(|view| &mut view.daylight) {
        multiply(&mut source.veil);
        multiply(&mut source.light);
    }
}

/// The target as each picture shows it: daylight alone may leave a channel dark, and lamps may bring one to full scale.
fn sights(
    fit: &Fit,
    vehicle: &Vehicle,
    options: &Options,
    file: &WaterFile,
) -> Result<Vec<Sight>, WaterError> {
    let response: CountResponse = file.sensor.response();
    let treatment = options.treatment(vehicle);
    let mut sights = Vec::new();
    for row in fit.places.iter().flatten() {
        let picture = treatment.open(&row.view())?.counts().filled();
        let linear = LinearPicture::of_counts(&picture, options.encoding);
        let at = Candidate {
            distance_m: row.distance_m,
            light_pct: row.light_pct,
        };
        let depth_m = row.depth_m.unwrap_or(SOME_DEPTH_M);
        sights.push(Sight::new(&file.place(&response, depth_m), &linear, &at));
    }
    Ok(sights)
}

fn numbers(fit: &Fit, daylight: Option<&Daylight>) -> FitNumbers {
    FitNumbers {
        a_relative_error: fit.a_per_m.map(|a| a.relative_error),
        b_relative_error: fit.b_per_m.map(|b| b.relative_error),
        backscatter_relative_error: fit.backscatter_fraction.relative_error,
        jerlov: fit.jerlov.map(|mixture| mixture.water.to_string()),
        jerlov_error: fit.jerlov.map(|mixture| mixture.error),
        lamp_gain: fit.lamp_gain.map(|gain| gain.value),
        lamp_gain_relative_error: fit.lamp_gain.map(|gain| gain.relative_error),
        daylight_gain: daylight.map(|daylight| daylight.gain),
        daylight_gain_relative_error: daylight.map(|daylight| daylight.relative_error),
        reflectance: fit.reflectance,
        names: Fit::names(),
        correlation: fit.correlation.clone(),
        not_identified: fit.not_identified.clone(),
        misfit: fit.misfit,
        exposure_s: fit.exposure_s,
        iso: fit.iso,
    }
}
