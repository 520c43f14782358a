//! Scenes to measure on, and a fixed set of samples through their pixels.

use std::path::Path;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Throughput};
use uw_render::backend::Device;
use uw_render::prepare::Prepared;
use uw_render::rays::{RayBatch, Rays, Selection};
use uw_render::scene::{Scene, SceneError};

/// Pixels per side of the grid through which samples go, and samples of each.
const GRID: u32 = 16;
const SAMPLES: u32 = 4;

/// A scene of `assets/benchmarks`.
pub fn read(name: &str) -> Result<Scene, SceneError> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/benchmarks");
    Scene::read(&Path::new(folder).join(format!("{name}.toml")))
}

/// Measures the same samples on one thread of `device` over and over; the rate is in samples.
pub fn bench_samples(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    scene: &Scene,
    device: &Device,
) {
    let prepared = Prepared::build(scene);
    let selection = Selection::all(&prepared, false, 0);
    let rays = Rays::new(device, &prepared, &selection).expect("few triangles");
    let mut tracer = rays.tracer();
    let camera = &prepared.camera;
    let cell = |i: u32, pixels: u32| f64::from(2 * i + 1) * f64::from(pixels) / f64::from(2 * GRID);
    let directions: Vec<_> = (0..GRID * GRID * SAMPLES)
        .map(|ray| ray / SAMPLES)
        .map(|at| {
            camera.direction(
                cell(at % GRID, camera.width),
                cell(at / GRID, camera.height),
            )
        })
        .collect();
    let batch = RayBatch {
        seed: 1,
        key: 0,
        batch: 0,
        first: 0,
    };
    group.throughput(Throughput::Elements(directions.len() as u64));
    group.bench_function(name, |bencher| {
        bencher.iter(|| {
            let lights = tracer.trace(&batch, camera.position_m, &directions);
            lights.expect("light").iter().count()
        });
    });
}
