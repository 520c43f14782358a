//! What layered water does to advice: calibrates in it at several depths, asks at each depth with each calibration, and
//! compares with the best place found from renders at that depth.
//!
//! ```sh
//! cargo run --release -p uw-survey --example layered_water
//! ```
//!
//! A Markdown table for each water goes to standard output; about four minutes of one core. "daemon" is what the daemon says
//! with its defaults; what follows is what the search finds without its checks. [docs/layered_water.md] explains it.
//!
//! [docs/layered_water.md]: ../../../docs/layered_water.md

#![expect(clippy::print_stdout, reason = "the tables are what it is for")]

use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use uw_calib::vehicle::Vehicle;
use uw_calib::{ContrastMeasurement, DepthMeasurement, ImageStats, Profile};
use uw_guidance::objective::Criterion;
use uw_guidance::{Candidate, Checks, Model, Objective, Observation, Strictness, advise_checked};
use uw_media::Iops;
use uw_render::scene::{Layer, Scene, Variation};
use uw_scenery::textures::Pattern;
use uw_twin::environment::{Target, View, WaterBody, scene, sensor};
use uw_twin::measure::{Quality, RenderedView};
use uw_twin::routine::{
    CONTRAST_LIGHT_PCT, DISTANCES_M, UP_DEPTHS_M, UP_SAMPLES, look_up_in, measure_depths, profile,
};

/// Depths at which calibrations are made and advice is asked for, m.
const DEPTHS_M: [f64; 3] = [1.0, 3.0, 5.0];
/// Where the vehicle is when it asks: distance in m, lamp level in percent.
const START: (f64, f64) = (1.5, 33.0);
/// Distances of the rendered truth, m: 0.5 to 3 by this.
const STEP_M: f64 = 0.5;
/// Lamp levels of the rendered truth, percent: 0 to 100 by this.
const STEP_PCT: f64 = 1.0;
/// Samples per pixel of each half of a view of the target.
const SAMPLES: u32 = 3;
/// Half the thickness of the change from one water to the next, m.
const HALF_CHANGE_M: f64 = 0.25;

/// A water: its name, and Jerlov types with the depth in m at which each begins.
type Water = (&'static str, &'static [(f64, &'static str)]);

const WATERS: [Water; 2] = [
    (
        "IB, from 2 to 4 m 5C",
        &[(0.0, "IB"), (2.0, "5C"), (4.0, "IB")],
    ),
    ("1C at every depth", &[(0.0, "1C")]),
];

/// The rendered truth at one depth: the target from every distance, with what pictures at every lamp level have.
struct Place {
    depth_m: f64,
    /// Distances in m, and mean and contrast at 0 to 100 % by [`STEP_PCT`].
    views: Vec<(f64, Vec<ImageStats>)>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    let model = Model::read(&assets.join("models/small_camera.json"))?;
    let target = Target::read(Pattern::HullRed, &assets)?;
    let vehicle = Vehicle {
        width: 240,
        height: 135,
        exposure: 8.0,
        ..Vehicle::default()
    };
    for water in WATERS {
        report(&vehicle, &target, &model, water)?;
    }
    Ok(())
}

/// One water's table.
fn report(
    vehicle: &Vehicle,
    target: &Target,
    model: &Model,
    (name, types): Water,
) -> Result<(), Box<dyn Error>> {
    let layers = layers(types)?;
    let in_water = |vehicle: &Vehicle, view: View| -> Result<Scene, Box<dyn Error>> {
        let body = WaterBody {
            jerlov: types[0].1.parse()?,
            backscatter_fraction: 0.0183,
        };
        let mut scene = scene(vehicle, &body, target, view)?;
        if let Some(water) = &mut scene.water {
            water.variation = Variation {
                layers: layers.clone(),
                plumes: Vec::new(),
            };
            water.iops = water.variation.mean_iops(water.iops);
        }
        Ok(scene)
    };
    let cancel = AtomicBool::new(false);
    let quality = |samples_per_half, seed| Quality {
        samples_per_half,
        seed,
        threads: None,
    };
    let (up_sensor, up) = look_up_in(
        vehicle,
        &UP_DEPTHS_M,
        quality(UP_SAMPLES, 1),
        &cancel,
        in_water,
    )?;
    let daylight = measure_depths(&up_sensor, &up);
    let mut places = Vec::new();
    let seen_by = sensor(vehicle, vehicle.exposure);
    for depth_m in DEPTHS_M {
        let mut views = Vec::new();
        for i in 0..=5 {
            let distance_m = 0.5 + STEP_M * f64::from(i);
            let scene = in_water(
                vehicle,
                View::Target {
                    depth_m,
                    distance_m,
                },
            )?;
            let view = RenderedView::render(&scene, quality(SAMPLES, 7), &cancel)?;
            let levels =
                (0..=100).map(|level| view.statistics(&seen_by, STEP_PCT * f64::from(level)));
            views.push((distance_m, levels.collect()));
        }
        eprintln!("{name}: {depth_m} m rendered");
        places.push(Place { depth_m, views });
    }
    let profiles = places
        .iter()
        .map(|place| place.calibrate(vehicle, &daylight))
        .collect::<Result<Vec<_>, _>>()?;
    println!("\n**{name}**\n");
    for (place, own) in places.iter().zip(&profiles) {
        let k_z = own.k_z(place.depth_m)?;
        let (on, off) = (own.k_c_on(START.0)?, own.k_c_off(START.0)?);
        println!(
            "- {} m: K_z {}; K_c at {} m, lamps on {}, off {}",
            place.depth_m,
            three(k_z, 3),
            START.0,
            three(on, 1),
            three(off, 1)
        );
    }
    println!(
        "\n| asked at, m | calibrated at, m | daemon | misfit | distance, m | lamps, % | contrast promised | rendered | score lost | best, m, % | score of staying, best |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for (place, own) in places.iter().zip(&profiles) {
        for (used, calibrated) in profiles.iter().zip(DEPTHS_M) {
            println!("{}", place.row(own, used, calibrated, model)?);
        }
    }
    Ok(())
}

/// A profile of layers with short changes between them, in three bands.
fn layers(types: &[(f64, &str)]) -> Result<Vec<Layer>, Box<dyn Error>> {
    let mut layers = Vec::new();
    let mut before: Option<Iops> = None;
    for (from_m, name) in types {
        let iops = uw_media::channel_iops(name.parse()?, &uw_media::Bands::Mean)?;
        let mut at = |depth_m: f64, iops: Iops| {
            layers.push(Layer {
                depth_m,
                iops,
                spectrum: None,
            });
        };
        if let Some(before) = before {
            at(from_m - HALF_CHANGE_M, before);
            at(from_m + HALF_CHANGE_M, iops);
        } else {
            at(*from_m, iops);
        }
        before = Some(iops);
    }
    Ok(layers)
}

impl Place {
    /// The profile of a routine whose pictures of the target are from this depth.
    fn calibrate(
        &self,
        vehicle: &Vehicle,
        daylight: &[DepthMeasurement],
    ) -> Result<Profile, Box<dyn Error>> {
        let mut contrast = Vec::new();
        for (distance_m, levels) in &self.views {
            if DISTANCES_M.contains(distance_m) {
                for light_pct in [0.0, CONTRAST_LIGHT_PCT] {
                    contrast.push(ContrastMeasurement {
                        distance_m: *distance_m,
                        light_pct,
                        contrast: levels[(light_pct / STEP_PCT).round() as usize].contrast,
                    });
                }
            }
        }
        let profile = profile(daylight, &contrast, "layered_water")?;
        let profile = profile.with_rig(vehicle.rig(Some(vehicle.exposure)));
        Ok(profile.with_contrast_depth([self.depth_m; 2])?)
    }

    /// Rendered contrast at a place, straight between the distances of the views, at the nearest level.
    fn contrast(&self, at: &Candidate) -> [f64; 3] {
        let level = (at.light_pct / STEP_PCT).round() as usize;
        let steps = (at.distance_m - self.views[0].0) / STEP_M;
        let i = (steps.floor() as usize).min(self.views.len() - 2);
        let t = steps - i as f64;
        let [near, far] = [i, i + 1].map(|i| self.views[i].1[level].contrast);
        std::array::from_fn(|k| (1.0 - t) * near[k] + t * far[k])
    }

    /// A row of the table: what `used`, calibrated at `calibrated` m, advises here, where `own` was calibrated.
    fn row(
        &self,
        own: &Profile,
        used: &Profile,
        calibrated: f64,
        model: &Model,
    ) -> Result<String, Box<dyn Error>> {
        let objective = Objective::default();
        let criterion = Criterion::new(&objective, own, self.depth_m, own.k_z(self.depth_m)?);
        let score = |at: &Candidate| criterion.score(self.contrast(at), at.distance_m);
        let start = Candidate {
            distance_m: START.0,
            light_pct: START.1,
        };
        let view = self.views.iter().find(|view| view.0 == START.0);
        let levels = &view.ok_or("the start is among the distances")?.1;
        let seen = levels[(start.light_pct / STEP_PCT).round() as usize];
        let observation = Observation {
            depth_m: self.depth_m,
            distance_m: start.distance_m,
            light_pct: start.light_pct,
            mean: seen.mean,
            std: seen.contrast,
            quality: None,
        };
        let lenient = Checks {
            misfit: Strictness::Ignore,
            training: Strictness::Ignore,
            other_depth: Strictness::Ignore,
            ..Checks::default()
        };
        let advice = advise_checked(&observation, used, model, &objective, &lenient);
        let advised = Candidate {
            distance_m: advice.distance_m,
            light_pct: advice.light_pct,
        };
        let mut best = (start, score(&start));
        for i in 0..=50 {
            for j in 0..=20 {
                let at = Candidate {
                    distance_m: 0.5 + 0.05 * f64::from(i),
                    light_pct: 5.0 * f64::from(j),
                };
                let score = score(&at);
                if score > best.1 {
                    best = (at, score);
                }
            }
        }
        let checked = advise_checked(&observation, used, model, &objective, &Checks::default());
        let mut told = vec![match (&checked.reason, checked.valid()) {
            (None, _) => "move".to_owned(),
            (Some(reason), true) => format!("valid, {}", reason.name()),
            (Some(reason), false) => format!("refused: {}", reason.name()),
        }];
        told.extend(
            checked
                .warnings
                .iter()
                .map(|reason| reason.name().to_owned()),
        );
        let told = told.join(", ");
        let misfit = advice
            .residual_here
            .map_or(f64::NAN, |residual| residual.misfit);
        Ok(format!(
            "| {} | {calibrated} | {told} | {misfit:.1} | {:.2} | {:.0} | {} | {} | {:.3} | {:.2}, {:.0} | {:.3}, {:.3} |",
            self.depth_m,
            advised.distance_m,
            advised.light_pct,
            advice
                .predicted_contrast
                .map_or("-".to_owned(), |c| three(c, 1)),
            three(self.contrast(&advised), 1),
            best.1 - score(&advised),
            best.0.distance_m,
            best.0.light_pct,
            score(&start),
            best.1
        ))
    }
}

fn three(values: [f64; 3], decimals: usize) -> String {
    values.map(|value| format!("{value:.decimals$}")).join(" ")
}
