//! Errors of pictures before and after `uw render --denoise`, what part of them is bias, the error that is estimated of them,
//! and what a relative squared error of 1e-2 costs with it and without.
//!
//! `cargo run --release -p uw-survey --example denoise_error -- SPP[,SPP..] SEEDS REFERENCE_SPP SCENE...`; where there is no
//! stored reference beside a scene, one of REFERENCE_SPP samples is rendered and kept in `target/denoise_references`. Pictures
//! are at most 320 pixels wide; marine snow is left out.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use uw_error_time::error::compare;
use uw_error_time::reference::{Provenance, Reference};
use uw_error_time::scene::{BenchmarkScene, Size};
use uw_render::backend::Device;
use uw_render::denoise::{self, DenoiseFacts};
use uw_render::film::FilmLayer;
use uw_render::integrator::Plan;

const WIDTH_PX: u32 = 320;
const REFERENCE_SEED: u64 = 1 << 40;
const KEPT: &str = "target/denoise_references";
/// The relative squared error whose cost is told.
const GOAL: f64 = 1e-2;

type Fallible<T> = Result<T, Box<dyn Error>>;

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [samples, seeds, reference, scenes @ ..] = &arguments[..] else {
        return Err("give SPP[,SPP..] SEEDS REFERENCE_SPP SCENE...".into());
    };
    let samples: Vec<u32> = samples
        .split(',')
        .map(str::parse)
        .collect::<Result<_, _>>()?;
    let (seeds, reference) = (seeds.parse()?, reference.parse()?);
    println!(
        "| scene | spp | relMSE | denoised | ratio | of it bias | estimated over true error: bias alone | all | least and most of the seeds | mean off by, % (R, G, B) | render, CPU s | denoising, CPU s | times less time to {GOAL:.0e} |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for path in scenes {
        let scene = scene(Path::new(path))?;
        let reference = reference_of(&scene, reference)?;
        for &samples in &samples {
            println!("{}", row(&scene, &reference, samples, seeds)?);
        }
    }
    Ok(())
}

fn scene(path: &Path) -> Fallible<BenchmarkScene> {
    let scene = BenchmarkScene::read(path, Size::default())?;
    if scene.size_px().0 <= WIDTH_PX {
        return Ok(scene);
    }
    let size = Size {
        width: Some(WIDTH_PX),
        height: None,
    };
    Ok(BenchmarkScene::read(path, size)?)
}

/// One picture and its errors.
struct Shot {
    picture: Vec<[f64; 3]>,
    before: f64,
    after: f64,
    off: [f64; 3],
    facts: DenoiseFacts,
    cpu_s: f64,
}

fn shot(scene: &BenchmarkScene, reference: &Reference, samples: u32, seed: u64) -> Fallible<Shot> {
    let plan = Plan {
        samples_per_pixel: Some(samples),
        max_bounces: scene.max_bounces(),
        ..Plan::new(seed)
    };
    let (cancel, device) = (AtomicBool::new(false), Device::CpuSimd);
    let rendered = denoise::render(&device, scene.prepared(), &plan, false, &cancel, &|_| {});
    let (mut film, stats) = rendered?;
    film.show_snow(None);
    let picture = film.layer(FilmLayer::Total);
    let clean = compare(&picture, [0.0; 3], reference);
    film.show_denoised(None);
    let noisy = compare(&film.layer(FilmLayer::Total), [0.0; 3], reference);
    let facts = stats.denoised.ok_or("no facts")?;
    Ok(Shot {
        picture,
        before: noisy.rel_mse,
        after: clean.rel_mse,
        off: clean.bias,
        facts,
        cpu_s: stats.cpu_s,
    })
}

/// A line of the table: means over seeds.
fn row(
    scene: &BenchmarkScene,
    reference: &Reference,
    samples: u32,
    seeds: u64,
) -> Fallible<String> {
    let shots: Vec<Shot> = (0..seeds)
        .map(|seed| shot(scene, reference, samples, seed))
        .collect::<Result<_, _>>()?;
    let mean = |of: &dyn Fn(&Shot) -> f64| shots.iter().map(of).sum::<f64>() / seeds as f64;
    let (before, after) = (mean(&|shot| shot.before), mean(&|shot| shot.after));
    let estimated = mean(&|shot| shot.facts.relative_error.powi(2));
    let bias = (after - noise(&shots, reference)).max(0.0);
    let ratio = |shot: &Shot| shot.facts.relative_error / shot.after.sqrt();
    let least = shots.iter().map(ratio).fold(f64::INFINITY, f64::min);
    let most = shots.iter().map(ratio).fold(0.0, f64::max);
    let off = [0, 1, 2].map(|k| 100.0 * mean(&|shot| shot.off[k]));
    let (cpu_s, denoising_s) = (mean(&|s| s.cpu_s), mean(&|s| s.facts.cpu_s));
    let without = cpu_s * (before / GOAL).max(1.0 / f64::from(samples));
    let gain = match after <= GOAL {
        true => format!("{:.1}", without / (cpu_s + denoising_s)),
        false => "-".to_owned(),
    };
    Ok(format!(
        "| {} | {samples} | {before:.2e} | {after:.2e} | {:.0} | {:.2} | {:.2} | {:.2} | {least:.2}, {most:.2} | {:+.2}, {:+.2}, {:+.2} | {cpu_s:.2} | {denoising_s:.2} | {gain} |",
        scene.name,
        before / after,
        bias / after,
        (mean(&|shot| shot.facts.relative_bias.powi(2)) / bias).sqrt(),
        (estimated / after).sqrt(),
        off[0],
        off[1],
        off[2],
    ))
}

/// The part of the relative squared error of the pictures in which they differ.
fn noise(shots: &[Shot], reference: &Reference) -> f64 {
    let n = shots.len() as f64;
    let pixels = reference.mean.len();
    let mean: [f64; 3] =
        std::array::from_fn(|k| reference.mean.iter().map(|p| p[k]).sum::<f64>() / pixels as f64);
    let mut sum = 0.0;
    for (i, truth) in reference.mean.iter().enumerate() {
        for k in 0..3 {
            let values = || shots.iter().map(|shot| shot.picture[i][k]);
            let own = values().sum::<f64>() / n;
            let spread = values().map(|v| (v - own).powi(2)).sum::<f64>() / (n - 1.0);
            let level = truth[k] * truth[k] + 1e-4 * mean[k] * mean[k];
            sum += if spread > 0.0 { spread / level } else { 0.0 };
        }
    }
    sum / (3 * pixels) as f64
}

/// The stored reference of a scene, or one made now.
fn reference_of(scene: &BenchmarkScene, samples: u32) -> Fallible<Reference> {
    let folder = scene.path.with_file_name("references");
    if let Ok(stored) = Reference::read_for(&folder, scene) {
        return Ok(stored);
    }
    if let Ok(kept) = Reference::read_for(Path::new(KEPT), scene)
        && kept.made.samples_per_pixel >= u64::from(samples)
    {
        return Ok(kept);
    }
    let plan = Plan {
        samples_per_pixel: Some(samples),
        max_bounces: scene.max_bounces(),
        ..Plan::new(REFERENCE_SEED)
    };
    let cancel = AtomicBool::new(false);
    let (mut film, stats) = Device::CpuSimd.render(scene.prepared(), &plan, &cancel, &|_| {})?;
    film.show_snow(None);
    let made = Provenance {
        scene_hash: scene.hash.clone(),
        seed: plan.seed,
        samples_per_pixel: stats.samples_per_pixel,
        version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let reference = Reference::of_film(&film, made);
    std::fs::create_dir_all(KEPT)?;
    reference.write(&Reference::path(Path::new(KEPT), scene))?;
    Ok(reference)
}
