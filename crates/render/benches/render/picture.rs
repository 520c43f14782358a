//! From samples to files: adding to the film, reading it, the sensor, EXR and PNG files. Rates are pixels per second.

use std::hint::black_box;

use criterion::{Criterion, Throughput};
use uw_render::backend::Device;
use uw_render::film::{BatchMean, Film, FilmLayer};
use uw_render::image::{ExrImage, Picture, write_frame};
use uw_render::prepare::Prepared;
use uw_render::rays::{Light, RayBatch, Rays, Selection};
use uw_render::scene::{Encoding, Exposure, Noise, SceneError, Sensor};

use super::scenes::read;

const WIDTH: u32 = 320;
const HEIGHT: u32 = 180;

/// The rates of all steps on a picture of 320 × 180 pixels.
pub fn bench(criterion: &mut Criterion) -> Result<(), SceneError> {
    let samples = samples()?;
    let film = filled(&samples);
    let picture = Picture {
        width: WIDTH,
        height: HEIGHT,
        data: film
            .layer(FilmLayer::Total)
            .into_iter()
            .map(|p| p.map(|v| v as f32))
            .collect(),
    };
    let mut group = criterion.benchmark_group("picture");
    group.throughput(Throughput::Elements(u64::from(WIDTH * HEIGHT)));
    let mut fill = film.clone();
    group.bench_function("film add", |bencher| {
        bencher.iter(|| add(&mut fill, &samples))
    });
    group.bench_function("film error", |bencher| {
        bencher.iter(|| black_box(&film).relative_error());
    });
    let sensor = Sensor {
        exposure: Exposure::AutoMean(0.4),
        encoding: Encoding::Srgb,
        bits: 8,
        noise: Some(Noise { a: 1e-3, b: 1e-5 }),
        ..Sensor::default()
    };
    group.bench_function("sensor", |bencher| {
        bencher.iter(|| sensor.expose(black_box(&picture), 1));
    });
    bench_files(&mut group, &picture, &sensor);
    group.finish();
    Ok(())
}

fn bench_files(
    group: &mut criterion::BenchmarkGroup<'_, criterion::measurement::WallTime>,
    picture: &Picture,
    sensor: &Sensor,
) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let [exr, half, png] = ["out.exr", "half.exr", "out.png"].map(|name| folder.path().join(name));
    let (image, frame) = (ExrImage::new(picture.clone()), sensor.expose(picture, 1));
    group.bench_function("exr write", |bencher| {
        bencher.iter(|| image.write(&exr).expect("written"));
    });
    group.bench_function("exr write half", |bencher| {
        bencher.iter(|| image.write_half(&half).expect("written"));
    });
    group.bench_function("exr read", |bencher| {
        image.write(&exr).expect("written");
        bencher.iter(|| ExrImage::read(&exr).expect("read"));
    });
    group.bench_function("png write", |bencher| {
        bencher.iter(|| write_frame(&png, &frame).expect("written"));
    });
}

/// A sample of every column of the middle row of a lamp scene: the sums of its layers.
fn samples() -> Result<Vec<BatchMean>, SceneError> {
    let prepared = Prepared::build(&read("s2_turbid")?);
    let lamp = Selection::all(&prepared, false, 0);
    let rays = Rays::new(&Device::Cpu, &prepared, &lamp).expect("few triangles");
    let camera = &prepared.camera;
    let column = |i: u32| camera.direction(f64::from(i) + 0.5, 0.5 * f64::from(HEIGHT));
    let directions: Vec<_> = (0..WIDTH).map(column).collect();
    let batch = RayBatch {
        seed: 1,
        key: 0,
        batch: 0,
        first: 0,
    };
    let mut tracer = rays.tracer();
    let lights = tracer.trace(&batch, camera.position_m, &directions);
    let mean = |light: Light<'_>| {
        let layers = [
            light.ambient(),
            light.direct(),
            light.backscatter(),
            light.lamps()[0],
        ];
        BatchMean::of_sums(layers.as_flattened(), 1, &[1.0])
    };
    Ok(lights.expect("light").iter().map(mean).collect())
}

/// A film of two batches.
fn filled(samples: &[BatchMean]) -> Film {
    let mut film = Film::new(WIDTH, HEIGHT, 1);
    add(&mut film, samples);
    add(
        &mut film,
        &samples.iter().rev().cloned().collect::<Vec<_>>(),
    );
    film
}

/// Adds a batch of one sample to every pixel.
fn add(film: &mut Film, samples: &[BatchMean]) {
    for row in &mut film.rows {
        for (column, mean) in samples.iter().enumerate() {
            row.add(column, 1, mean, 1);
        }
        row.finish_batch(1);
    }
}
