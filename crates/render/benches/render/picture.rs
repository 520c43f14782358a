//! From samples to files: adding to the film, reading it, the sensor, EXR and PNG files. Rates are pixels per second.

use std::hint::black_box;

use criterion::{Criterion, Throughput};
use uw_render::film::{BatchMean, Film, FilmLayer};
use uw_render::image::{ExrImage, Picture, write_frame};
use uw_render::integrator::cpu::{Scores, Selection, Worker};
use uw_render::prepare::Prepared;
use uw_render::scene::{Encoding, Exposure, Noise, SceneError, Sensor};

use super::scenes::read;

const WIDTH: u32 = 320;
const HEIGHT: u32 = 180;

/// The rates of all steps on a picture of 320 × 180 pixels.
pub fn bench(criterion: &mut Criterion) -> Result<(), SceneError> {
    let scores = scores()?;
    let film = filled(&scores);
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
        bencher.iter(|| add(&mut fill, &scores))
    });
    group.bench_function("film error", |bencher| {
        bencher.iter(|| black_box(&film).relative_error());
    });
    let sensor = Sensor {
        exposure: Exposure::AutoMean(0.4),
        encoding: Encoding::Srgb,
        bits: 8,
        noise: Some(Noise { a: 1e-3, b: 1e-5 }),
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

/// A sample of every column of the middle row of a lamp scene.
fn scores() -> Result<Vec<Scores>, SceneError> {
    let prepared = Prepared::build(&read("s2_turbid")?);
    let selection = Selection {
        lamps: vec![0],
        ambient: false,
        max_events: usize::MAX,
        share_walks: 1,
    };
    let mut worker = Worker::new(&prepared, &selection);
    Ok((0..WIDTH)
        .map(|column| worker.sample(1, column, HEIGHT / 2, 0, 0).clone())
        .collect())
}

/// A film of two batches.
fn filled(scores: &[Scores]) -> Film {
    let mut film = Film::new(WIDTH, HEIGHT, 1);
    add(&mut film, scores);
    add(&mut film, &scores.iter().rev().cloned().collect::<Vec<_>>());
    film
}

/// Adds a batch of one sample to every pixel.
fn add(film: &mut Film, scores: &[Scores]) {
    let mut mean = BatchMean::new(1);
    for row in &mut film.rows {
        for (column, scores) in scores.iter().enumerate() {
            mean.clear();
            mean.add(scores, 1.0);
            row.add(column, 1, &mean, 1);
        }
        row.finish_batch(1);
    }
}
