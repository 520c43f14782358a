//! How well contrast is predicted by physics, the water being known: pictures of targets that nothing was trained on, each used
//! to predict the contrast of all others of its depth.
//!
//! `cargo run --release -p uw-survey --example physics_accuracy -- WATER B TEXTURE DEPTH_M,.. MEMORY,.. [ROWS.csv]`; a memory is `none`, a
//! texture whose calibration is remembered, or distances as in `1m+3m`: the vehicle has been there, lamps off, and remembers its pictures; `gravel@1m+3m`: before
//! gravel. ROWS.csv gets a row for each prediction (`tools/hybrid_trial.py`).

#![allow(clippy::print_stdout, reason = "that is what it is for")]

use std::error::Error;
use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use uw_assets::assets_dir;
use uw_calib::Encoding;
use uw_calib::picture::Counts;
use uw_calib::response::{CountResponse, LinearNoise};
use uw_calib::vehicle::Vehicle;
use uw_guidance::features::Candidate;
use uw_guidance::physics::Sight;
use uw_guidance::physics::predict::Place;
use uw_guidance::physics::{LinearPicture, Predictor, WaterTables};
use uw_render::scene::Scene;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{EnvironmentError, Target, View, WaterBody, scene, sensor};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::response;
use uw_twin::estimate::target_image::TargetImage;
use uw_twin::estimate::water_tables::{TablePlan, even_texture, water_tables};

const DISTANCES_M: [f64; 6] = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0];
const CALIBRATION_DEPTH_M: f64 = 3.0;
const LEVELS_PCT: [f64; 4] = [0.0, 33.0, 67.0, 100.0];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [water, fraction, texture, depths, memories, rows @ ..] = &arguments[..] else {
        return Err("give WATER B TEXTURE DEPTH_M,.. MEMORY_TEXTURE|none,.. [ROWS.csv]".into());
    };
    let vehicle = Vehicle::default();
    let body = WaterBody {
        jerlov: water.parse()?,
        backscatter_fraction: fraction.parse()?,
    };
    let pattern = Pattern::from_name(texture).ok_or("no such texture")?;
    let target = Target::read(pattern, &assets_dir()?)?;
    let noise = LinearNoise {
        a: vehicle.noise_a,
        b: vehicle.noise_b,
    };
    let counts = CountResponse::new(Encoding::Srgb, noise);
    let tables = tables(&vehicle, &body, pattern)?;
    let shots_of = |target: &Target, depth_m: f64, levels: &[f64], seed: u64| {
        shots(&vehicle, &body, target, depth_m, levels, seed)
    };
    let place_at = |depth_m: f64| Place {
        tables: &tables,
        response: &counts,
        exposure: vehicle.exposure,
        daylight: [1.0; 3],
        lamps: [1.0; 3],
        depth_m,
        doubt: None,
    };
    let mut sights = Vec::new();
    for memory in memories.split(',') {
        let mut remembered = Vec::new();
        if let Some(pattern) = Pattern::from_name(memory) {
            let target = Target::read(pattern, &assets_dir()?)?;
            for (here, picture, _) in shots_of(&target, CALIBRATION_DEPTH_M, &[0.0], 77)? {
                let place = place_at(CALIBRATION_DEPTH_M);
                remembered.push(Sight::new(&place, &picture, &here));
            }
        }
        sights.push((memory, remembered));
    }
    for depth in depths.split(',') {
        let depth_m: f64 = depth.parse()?;
        let shots = shots_of(&target, depth_m, &LEVELS_PCT, 11)?;
        for (memory, remembered) in &sights {
            let (other, places) = match memory.split_once('@') {
                Some((other, places)) => (Pattern::from_name(other), places),
                None => (None, *memory),
            };
            let others = match other {
                Some(pattern) => {
                    let target = Target::read(pattern, &assets_dir()?)?;
                    Some(shots_of(&target, depth_m, &[0.0], 77)?)
                }
                None => None,
            };
            let been = been_at_m(places);
            let come = others
                .as_ref()
                .unwrap_or(&shots)
                .iter()
                .filter(|(at, ..)| been.contains(&at.distance_m) && at.light_pct == 0.0);
            let earlier: Vec<Sight> = come
                .map(|(at, picture, _)| Sight::new(&place_at(depth_m), picture, at))
                .collect();
            let sights = [&earlier[..], remembered];
            println!("{water} {fraction} {texture} at {depth_m} m, memory of {memory}:");
            cell(&place_at(depth_m), &shots, sights);
            if let Some(file) = rows.first() {
                let name = format!("{water},{texture},{depth_m},{memory}");
                write_rows(Path::new(file), &name, &place_at(depth_m), &shots, sights)?;
            }
        }
    }
    Ok(())
}

/// The distances of a memory like `1m+3m`, m.
fn been_at_m(memory: &str) -> Vec<f64> {
    let distance = |part: &str| part.strip_suffix('m')?.parse().ok();
    memory.split('+').filter_map(distance).collect()
}

/// The water's tables, as `uw water-tables` makes them.
fn tables(
    vehicle: &Vehicle,
    body: &WaterBody,
    pattern: Pattern,
) -> Result<WaterTables, Box<dyn Error>> {
    let started = Instant::now();
    let even = Target {
        pattern,
        texture: even_texture(0.2),
    };
    let plan = TablePlan {
        distances_m: (0..12)
            .map(|i| 0.5 * 6f64.powf(f64::from(i) / 11.0))
            .collect(),
        depths_m: vec![1.0, 3.0, 5.0],
        reflectance: 0.2,
        paths_per_group: 16384,
        seed: 5,
    };
    let of = |depth_m: f64, distance_m: f64| -> Result<Scene, EnvironmentError> {
        let view = View::Target {
            depth_m,
            distance_m,
        };
        scene(vehicle, body, &even, view)
    };
    let tables = water_tables(&plan, of)?;
    println!("tables: {:.1} s", started.elapsed().as_secs_f64());
    Ok(tables)
}

/// Each picture predicts all others.
fn cell(place: &Place, shots: &[Shot], sights: [&[Sight]; 2]) {
    let mut sums = [[0.0; 3]; 3];
    let mut n = [[0.0; 3]; 3];
    let mut asked = 0.0;
    let mut within = [0.0; 3];
    for (here, picture, stats) in shots {
        let predictor =
            Predictor::on_the_way(place.clone(), picture, (here, stats.contrast), sights);
        let mut own = 0.0;
        for (there, _, label) in shots {
            let found = predictor.contrast(there);
            let kind = match there.distance_m.total_cmp(&here.distance_m) {
                std::cmp::Ordering::Less => 0,
                std::cmp::Ordering::Equal => 1,
                std::cmp::Ordering::Greater => 2,
            };
            asked += 3.0;
            let told = predictor.unknown().map(|unknown| unknown.is_none());
            for k in (0..3).filter(|&k| told[k]) {
                let error = (found.counts[k] - label.contrast[k]).abs() / 15.0;
                sums[kind][k] += error;
                n[kind][k] += 1.0;
                within[kind] += f64::from(u8::from(15.0 * error < 1.645 * found.error_counts[k]));
                own += error / 3.0 / shots.len() as f64;
            }
            if std::env::var_os("EACH").is_some() {
                println!(
                    "  {:.1} m {:3.0} % to {:.1} m {:3.0} %: found {:.2?} +- {:.2?}, true {:.2?}",
                    here.distance_m,
                    here.light_pct,
                    there.distance_m,
                    there.light_pct,
                    found.counts,
                    found.error_counts,
                    label.contrast
                );
            }
        }
        println!(
            "from {:.1} m {:3.0} %: contrast {:.2?} predicted here {:.2?} mean {:.1?} reflectance {:.3?} state {:.2?} unknown {:?}; error of all {:.4}",
            here.distance_m,
            here.light_pct,
            stats.contrast,
            predictor.contrast(here).counts,
            stats.mean,
            predictor.reflectance(),
            predictor.correction(),
            predictor.unknown(),
            own
        );
    }
    for (kind, name) in ["nearer", "same", "farther"].iter().enumerate() {
        let told: f64 = n[kind].iter().sum();
        let mean: [f64; 3] = std::array::from_fn(|k| sums[kind][k] / n[kind][k]);
        let held = within[kind] / told;
        println!("{name}: MAE/15 {mean:.4?}, {held:.2} of {told} within 90 % intervals");
    }
    let told = n.iter().flatten().sum::<f64>();
    let all = sums.iter().flatten().sum::<f64>() / told;
    println!("ALL {all:.4}, {:.2} of the channels told", told / asked);
}

/// Appends what each picture predicts of each other, what it shows itself, and the truth; a row per channel that is told.
fn write_rows(
    path: &Path,
    name: &str,
    place: &Place,
    shots: &[Shot],
    sights: [&[Sight]; 2],
) -> Result<(), Box<dyn Error>> {
    let mut out = OpenOptions::new().create(true).append(true).open(path)?;
    if out.metadata()?.len() == 0 {
        let windows = WINDOWS_PX.map(|px| format!("within_{px}_px"));
        writeln!(
            out,
            "water,texture,depth_m,memory,channel,distance_m,light_pct,to_distance_m,to_light_pct,contrast,mean,{},predicted_here,predicted,\
             error,truth",
            windows.join(",")
        )?;
    }
    for (here, picture, stats) in shots {
        let predictor =
            Predictor::on_the_way(place.clone(), picture, (here, stats.contrast), sights);
        let own = predictor.contrast(here).counts;
        let bands = [0, 1, 2].map(|k| WINDOWS_PX.map(|px| within(picture, px, k)));
        for (there, _, label) in shots {
            let found = predictor.contrast(there);
            for k in (0..3).filter(|&k| predictor.unknown()[k].is_none()) {
                let bands = bands[k].map(|band| format!("{band:.4e}"));
                writeln!(
                    out,
                    "{name},{k},{},{},{},{},{:.4},{:.3},{},{:.4},{:.4},{:.4},{:.4}",
                    here.distance_m,
                    here.light_pct,
                    there.distance_m,
                    there.light_pct,
                    stats.contrast[k],
                    stats.mean[k],
                    bands.join(","),
                    own[k],
                    found.counts[k],
                    found.error_counts[k],
                    label.contrast[k]
                )?;
            }
        }
    }
    Ok(())
}

/// Edges of the windows whose variance rows have.
const WINDOWS_PX: [usize; 6] = [2, 4, 8, 16, 32, 64];

/// Mean variance of a channel's signal inside windows of so many pixels.
fn within(picture: &LinearPicture, px: usize, k: usize) -> f64 {
    let (across, down) = (picture.width / px, picture.height / px);
    let area = (px * px) as f64;
    let variance = |window: usize| {
        let (x, y) = (window % across * px, window / across * px);
        let rows = (y..y + px).flat_map(|row| {
            let first = row * picture.width + x;
            picture.signal[first..first + px].iter()
        });
        let (sum, square) = rows.fold((0.0, 0.0), |(sum, square), pixel| {
            let signal = f64::from(pixel[k]);
            (sum + signal, square + signal * signal)
        });
        square / area - (sum / area).powi(2)
    };
    (0..across * down).map(variance).sum::<f64>() / (across * down) as f64
}

type Shot = (Candidate, LinearPicture, uw_calib::ImageStats);

/// Pictures of a target from all distances.
fn shots(
    vehicle: &Vehicle,
    body: &WaterBody,
    target: &Target,
    depth_m: f64,
    levels_pct: &[f64],
    seed: u64,
) -> Result<Vec<Shot>, Box<dyn Error>> {
    let exposure = vehicle.exposure;
    let labels = response::CountResponse::new(&sensor(vehicle, exposure));
    let pyramid = TexturePyramid::new(&target.texture, f64::from(target.pattern.tile_m()));
    let never = AtomicBool::new(false);
    let mut shots = Vec::new();
    for distance_m in DISTANCES_M {
        let view = View::Target {
            depth_m,
            distance_m,
        };
        let scene = scene(vehicle, body, target, view)?;
        let image =
            TargetImage::render(&scene, &pyramid, seed, 4096, &never)?.expect("not stopped");
        for &light_pct in levels_pct {
            let picture = image.picture(light_pct);
            let stats = image.statistics(&labels, exposure, light_pct);
            let stored = sensor(vehicle, exposure)
                .expose(&picture, seed)
                .in_8_bit_counts();
            let stored = Counts::stored(picture.width as usize, picture.height as usize, stored);
            let linear = LinearPicture::of_counts(&stored, Encoding::Srgb);
            let at = Candidate {
                distance_m,
                light_pct,
            };
            shots.push((at, linear, stats));
        }
    }
    Ok(shots)
}
