//! Errors of pictures before and after `uw render --denoise`, their bias, and the error that is estimated of them.
//!
//! `cargo run --release -p uw-survey --example denoise_error -- SPP REFERENCE_SPP SCENE...`; where there is no stored reference
//! beside a scene, one of REFERENCE_SPP samples is rendered. Pictures are at most 320 pixels wide.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use uw_render::backend::Device;
use uw_render::denoise;
use uw_render::film::FilmLayer;
use uw_render::integrator::Plan;
use uw_survey::error_time::error::compare;
use uw_survey::error_time::reference::{Provenance, Reference};
use uw_survey::error_time::scene::{BenchmarkScene, Size};

const WIDTH_PX: u32 = 320;
const REFERENCE_SEED: u64 = 1 << 40;
const SEEDS: u64 = 3;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [samples, reference, scenes @ ..] = &arguments[..] else {
        return Err("give SPP REFERENCE_SPP SCENE...".into());
    };
    let (samples, reference) = (samples.parse()?, reference.parse()?);
    println!(
        "| scene | relMSE at {samples} spp | denoised | ratio | estimated over true error (rms) | bias, % (R, G, B) | render, CPU s | denoising, s |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for scene in scenes {
        println!("{}", row(Path::new(scene), samples, reference)?);
    }
    Ok(())
}

/// A line of the table, means over seeds.
fn row(path: &Path, samples: u32, reference_samples: u32) -> Result<String, Box<dyn Error>> {
    let mut scene = BenchmarkScene::read(path, Size::default())?;
    if scene.size_px().0 > WIDTH_PX {
        let width = Some(WIDTH_PX);
        scene = BenchmarkScene::read(
            path,
            Size {
                width,
                height: None,
            },
        )?;
    }
    let reference = reference_of(&scene, reference_samples)?;
    let (mut before, mut after, mut estimated) = (0.0, 0.0, 0.0);
    let (mut bias, mut cpu_s, mut seconds) = ([0.0; 3], 0.0, 0.0);
    let n = SEEDS as f64;
    for seed in 0..SEEDS {
        let plan = Plan {
            samples_per_pixel: Some(samples),
            max_bounces: scene.max_bounces(),
            ..Plan::new(seed)
        };
        let cancel = AtomicBool::new(false);
        let rendered = denoise::render(
            &Device::CpuSimd,
            scene.prepared(),
            &plan,
            false,
            &cancel,
            &|_| {},
        );
        let (mut film, stats) = rendered?;
        let facts = stats.denoised.ok_or("no facts")?;
        let clean = compare(&film.layer(FilmLayer::Total), [0.0; 3], &reference);
        film.show_denoised(None);
        let noisy = compare(&film.layer(FilmLayer::Total), [0.0; 3], &reference);
        before += noisy.rel_mse / n;
        after += clean.rel_mse / n;
        estimated += facts.relative_error.powi(2) / n;
        (0..3).for_each(|k| bias[k] += 100.0 * clean.bias[k] / n);
        cpu_s += stats.cpu_s / n;
        seconds += facts.seconds / n;
    }
    let [r, g, b] = bias;
    Ok(format!(
        "| {} | {before:.2e} | {after:.2e} | {:.0} | {:.2} | {r:+.2}, {g:+.2}, {b:+.2} | {cpu_s:.2} | {seconds:.2} |",
        scene.name,
        before / after,
        (estimated / after).sqrt()
    ))
}

/// The stored reference of a scene, or one made now.
fn reference_of(scene: &BenchmarkScene, samples: u32) -> Result<Reference, Box<dyn Error>> {
    let folder = scene.path.with_file_name("references");
    if let Ok(stored) = Reference::read_for(&folder, scene) {
        return Ok(stored);
    }
    let plan = Plan {
        samples_per_pixel: Some(samples),
        max_bounces: scene.max_bounces(),
        ..Plan::new(REFERENCE_SEED)
    };
    let cancel = AtomicBool::new(false);
    let (film, stats) = Device::CpuSimd.render(scene.prepared(), &plan, &cancel, &|_| {})?;
    let made = Provenance {
        scene_hash: scene.hash.clone(),
        seed: plan.seed,
        samples_per_pixel: stats.samples_per_pixel,
        version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    Ok(Reference::of_film(&film, made))
}
