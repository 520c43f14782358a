//! Scenes to measure on, and a fixed set of samples through their pixels.

use std::path::Path;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Throughput};
use uw_render::integrator::cpu::{Selection, Work, Worker};
use uw_render::prepare::Prepared;
use uw_render::scene::{Scene, SceneError};

/// Pixels per side of the grid through which samples go, and samples of each.
const GRID: u32 = 8;
const SAMPLES: u32 = 4;

/// What a rate counts.
#[derive(Clone, Copy)]
pub enum Unit {
    /// Samples of pixels.
    Samples,
    /// Vertices of walks and bridges.
    Vertices,
}

/// A scene of `assets/benchmarks`.
pub fn read(name: &str) -> Result<Scene, SceneError> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/benchmarks");
    Scene::read(&Path::new(folder).join(format!("{name}.toml")))
}

/// Measures the same samples over and over; their rate is in `unit`.
pub fn bench_samples(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    scene: &Scene,
    unit: Unit,
) {
    let prepared = Prepared::build(scene);
    let lit = |i: &usize| prepared.lamps[*i].level > 0.0;
    let selection = Selection {
        lamps: (0..prepared.lamps.len()).filter(lit).collect(),
        ambient: prepared.needs.ambient(),
        max_events: usize::MAX,
        share_walks: 1,
    };
    let mut worker = Worker::new(&prepared, &selection);
    let work = trace(&mut worker, &prepared);
    group.throughput(Throughput::Elements(match unit {
        Unit::Samples => u64::from(GRID * GRID * SAMPLES),
        Unit::Vertices => work.vertices,
    }));
    group.bench_function(name, |bencher| {
        bencher.iter(|| trace(&mut worker, &prepared))
    });
}

/// Traces the set of samples once; returns the work it took, which is the same every time.
fn trace(worker: &mut Worker, prepared: &Prepared) -> Work {
    let before = worker.work;
    let (width, height) = (prepared.camera.width, prepared.camera.height);
    for cell in 0..GRID * GRID {
        let column = (cell % GRID * 2 + 1) * width / (2 * GRID);
        let row = (cell / GRID * 2 + 1) * height / (2 * GRID);
        for sample in 0..SAMPLES {
            worker.sample(1, column, row, 0, sample);
        }
    }
    Work {
        paths: worker.work.paths - before.paths,
        vertices: worker.work.vertices - before.vertices,
    }
}
