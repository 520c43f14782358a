//! What a sun that training did not know does to the networks' predictions: for each sun a calibration under it, then pictures
//! from six distances at four lamp levels, each used to predict the contrast of all others.
//!
//! ```sh
//! cargo run --release -p uw-survey --example other_sun -- assets/models/default.json
//! ```
//!
//! A Markdown table goes to standard output; some minutes on two processors.

#![allow(clippy::print_stdout, reason = "the table is what it is for")]

use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use glam::DVec3;
use uw_assets::assets_dir;
use uw_calib::vehicle::Vehicle;
use uw_calib::{ContrastMeasurement, ImageStats, Profile};
use uw_guidance::advice::predict;
use uw_guidance::checks::Residual;
use uw_guidance::{Candidate, Checks, Model, Objective, Observation};
use uw_render::scene::Scene;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{Target, View, WaterBody, scene, sensor};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::response::CountResponse;
use uw_twin::estimate::target_image::TargetImage;
use uw_twin::measure::Quality;
use uw_twin::routine::{
    CONTRAST_DEPTH_M, CONTRAST_LIGHT_PCT, DISTANCES_M, UP_DEPTHS_M, UP_SAMPLES, look_up_in,
    measure_depths, profile,
};

/// Azimuth (0: behind the camera, 180: behind the target) and zenith angle of each sun, degrees; training's is the first.
const SUNS_DEG: [(f64, f64); 5] = [
    (0.0, 30.0),
    (90.0, 30.0),
    (180.0, 30.0),
    (0.0, 60.0),
    (180.0, 60.0),
];
const WATERS: [&str; 3] = ["IB", "1C", "5C"];
const LEVELS_PCT: [f64; 4] = [0.0, 33.0, CONTRAST_LIGHT_PCT, 100.0];
const PATHS: u32 = 4096;
/// Contrast in counts that is 1 in the published table.
const UNIT_COUNTS: f64 = 15.0;

/// What is counted over the moves of one row of the table.
#[derive(Default)]
struct Sums {
    error: f64,
    n: f64,
    error_trusted: f64,
    n_trusted: f64,
    pictures: f64,
    misfits: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("give a model file")?;
    let model = Model::read(Path::new(&file))?;
    let vehicle = Vehicle::default();
    let target = Target::read(Pattern::HullRed, &assets_dir()?)?;
    println!(
        "| azimuth, ° | zenith, ° | calibrated under | error / 15 | misfit above the limit | error / 15 of the others |"
    );
    println!("|---|---|---|---|---|---|");
    for sun in SUNS_DEG {
        let mut rows = [
            ("it", Sums::default()),
            ("the trained sun", Sums::default()),
        ];
        for water in WATERS {
            let seen = shots(&vehicle, water, &target, sun)?;
            let trained = shots(&vehicle, water, &target, SUNS_DEG[0])?;
            for ((_, sums), (sun, calibration)) in
                rows.iter_mut().zip([(sun, &seen), (SUNS_DEG[0], &trained)])
            {
                let profile = calibrate(&vehicle, water, &target, sun, calibration)?;
                count(sums, &seen, &profile, &model);
            }
        }
        for (calibrated, sums) in rows {
            println!(
                "| {} | {} | {calibrated} | {:.3} | {:.0} % | {:.3} |",
                sun.0,
                sun.1,
                sums.error / sums.n,
                100.0 * sums.misfits / sums.pictures,
                sums.error_trusted / sums.n_trusted
            );
        }
    }
    Ok(())
}

/// The scene of a view under another sun.
fn under(
    vehicle: &Vehicle,
    water: &str,
    target: &Target,
    view: View,
    (azimuth_deg, zenith_deg): (f64, f64),
) -> Result<Scene, Box<dyn Error>> {
    let body = WaterBody {
        jerlov: water.parse()?,
        backscatter_fraction: 0.0183,
    };
    let mut scene = scene(vehicle, &body, target, view)?;
    if let Some(sun) = &mut scene.sun {
        let (azimuth, zenith) = (azimuth_deg.to_radians(), zenith_deg.to_radians());
        let (sin, cos) = azimuth.sin_cos();
        sun.travel_direction = DVec3::new(zenith.sin() * cos, zenith.sin() * sin, -zenith.cos());
    }
    Ok(scene)
}

/// What pictures from all distances at all levels have.
fn shots(
    vehicle: &Vehicle,
    water: &str,
    target: &Target,
    sun: (f64, f64),
) -> Result<Vec<(Candidate, ImageStats)>, Box<dyn Error>> {
    let labels = CountResponse::new(&sensor(vehicle, vehicle.exposure));
    let pyramid = TexturePyramid::new(&target.texture, f64::from(target.pattern.tile_m()));
    let never = AtomicBool::new(false);
    let mut shots = Vec::new();
    for distance_m in DISTANCES_M {
        let view = View::Target {
            depth_m: CONTRAST_DEPTH_M,
            distance_m,
        };
        let scene = under(vehicle, water, target, view, sun)?;
        let image = TargetImage::render(&scene, &pyramid, 11, PATHS, &never)?.ok_or("stopped")?;
        for light_pct in LEVELS_PCT {
            let at = Candidate {
                distance_m,
                light_pct,
            };
            shots.push((at, image.statistics(&labels, vehicle.exposure, light_pct)));
        }
    }
    Ok(shots)
}

fn calibrate(
    vehicle: &Vehicle,
    water: &str,
    target: &Target,
    sun: (f64, f64),
    shots: &[(Candidate, ImageStats)],
) -> Result<Profile, Box<dyn Error>> {
    let quality = Quality {
        samples_per_half: UP_SAMPLES,
        seed: 1,
        threads: None,
    };
    let never = AtomicBool::new(false);
    let (up_sensor, up) = look_up_in(vehicle, &UP_DEPTHS_M, quality, &never, |vehicle, view| {
        under(vehicle, water, target, view, sun)
    })?;
    let contrast: Vec<_> = shots
        .iter()
        .filter(|(at, _)| at.light_pct == 0.0 || at.light_pct == CONTRAST_LIGHT_PCT)
        .map(|(at, stats)| ContrastMeasurement {
            distance_m: at.distance_m,
            light_pct: at.light_pct,
            contrast: stats.contrast,
        })
        .collect();
    let profile = profile(&measure_depths(&up_sensor, &up), &contrast, "other_sun")?;
    Ok(profile
        .with_rig(vehicle.rig(Some(vehicle.exposure)))
        .with_contrast_depth([CONTRAST_DEPTH_M; 2])?)
}

fn count(sums: &mut Sums, shots: &[(Candidate, ImageStats)], profile: &Profile, model: &Model) {
    let objective = Objective::default();
    let places: Vec<Candidate> = shots.iter().map(|(at, _)| *at).collect();
    for (at, stats) in shots {
        let now = Observation {
            depth_m: CONTRAST_DEPTH_M,
            distance_m: at.distance_m,
            light_pct: at.light_pct,
            mean: stats.mean,
            std: stats.contrast,
            quality: None,
        };
        let Ok(found) = predict(&now, &places, profile, model, &objective) else {
            continue;
        };
        let limit = Checks::default().max_misfit;
        let here = places.iter().position(|place| place == at);
        let here = here.map_or([f64::NAN; 3], |i| found.contrast[i]);
        let trusted = Residual::new(here, stats.contrast).misfit <= limit;
        sums.pictures += 1.0;
        sums.misfits += f64::from(u8::from(!trusted));
        for (prediction, (_, truth)) in found.contrast.iter().zip(shots) {
            for k in 0..3 {
                let error = (prediction[k] - truth.contrast[k]).abs() / UNIT_COUNTS;
                sums.error += error;
                sums.n += 1.0;
                if trusted {
                    sums.error_trusted += error;
                    sums.n_trusted += 1.0;
                }
            }
        }
    }
}
