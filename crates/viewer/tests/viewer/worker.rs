//! The worker without a window.

use std::sync::Arc;
use std::time::{Duration, Instant};

use uw_render::{
    backend::Device,
    film::FilmLayer,
    image::{LayerData, read_frame},
    integrator::{Plan, stepper::Stepper},
    layers::RenderLayer,
    prepare::Prepared,
};
use uw_viewer::model::{Coefficients, OpenScene, Settings, ShownLayer};
use uw_viewer::worker::{Activity, Export, Goal, News, RenderDevice, Worker};

use crate::support::{PATIENCE, frame, job, small, view, worker};

const SHORT: Goal = Goal {
    samples_per_pixel: 6,
    target_error: None,
};

/// A worker that renders without end and has shown every pixel.
fn endless(open: &OpenScene, settings: &Settings) -> Worker {
    let goal = Goal {
        samples_per_pixel: u64::MAX,
        target_error: None,
    };
    let worker = worker(settings, goal);
    worker.submit(job(1, open, settings));
    frame(&worker, |f| f.coarseness == 1);
    worker
}

#[test]
fn the_finished_picture_is_the_renderers() {
    for device in [Device::Cpu, Device::CpuSimd] {
        is_what_its_steps_make(device);
    }
}

fn is_what_its_steps_make(device: Device) {
    let is_native = matches!(device, Device::Cpu);
    let (open, settings) = small();
    let place = RenderDevice {
        device,
        threads: None,
    };
    let worker = Worker::start(place, view(&settings), SHORT, || {}).expect("a thread");
    worker.submit(job(1, &open, &settings));
    let done = frame(&worker, |f| f.activity == Activity::Done);
    // Batches of 1, 1, 1, 1 and 4 samples go beyond the 6 that were asked for.
    assert_eq!((done.generation, done.coarseness, done.samples), (1, 1, 8));
    assert!(done.relative_error.is_some_and(|e| e > 0.0 && e < 1.0));
    assert!(done.samples_per_s > 0.0);

    let scene = settings.scene().expect("valid");
    let prepared = Prepared::build_with(&scene, Arc::clone(&open.geometry));
    let plan = Plan {
        dark_lamps: true,
        ..Plan::new(7)
    };
    let mut stepper = if is_native {
        Stepper::new(&prepared, &plan)
    } else {
        Stepper::on_lanes(&prepared, &plan)
    }
    .expect("few triangles");
    let mut film = stepper.film();
    for samples in [1, 1, 1, 1, 4] {
        assert!(stepper.step(&mut film, samples, &|| false));
    }
    let expected = film.layer(FilmLayer::Total);
    for (got, expected) in done.shown.radiance.iter().zip(&expected) {
        assert_eq!(*got, expected.map(|x| x as f32));
    }
}

#[test]
fn a_change_ends_the_old_picture_and_only_the_new_one_is_current() {
    let (open, mut settings) = small();
    let worker = endless(&open, &settings);
    let lit = frame(&worker, |f| f.coarseness == 1).shown.radiance.clone();
    settings.sun = None;
    settings.sky_radiance = [0.0; 3];
    worker.submit(job(2, &open, &settings));
    let dark = frame(&worker, |f| f.generation == 2 && f.coarseness == 1);
    let mean = |data: &[[f32; 3]]| data.iter().map(|p| p[2]).sum::<f32>() / data.len() as f32;
    assert!(mean(&dark.shown.radiance) < 0.9 * mean(&lit));
    // Nothing of the first comes after the second.
    let end = Instant::now() + Duration::from_millis(300);
    let mut last = dark.serial;
    while Instant::now() < end {
        let latest = worker.latest().expect("a frame");
        assert_eq!(latest.generation, 2);
        assert!(latest.serial >= last);
        last = latest.serial;
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn pause_holds_the_samples_and_a_look_needs_no_new_ones() {
    let (open, settings) = small();
    let worker = endless(&open, &settings);
    worker.set_paused(true);
    let paused = frame(&worker, |f| f.activity == Activity::Paused);
    let mut other = view(&settings);
    other.display.layer = ShownLayer::Layer(RenderLayer::Depth);
    let revision = worker.set_view(other);
    let depth = frame(&worker, |f| f.view_revision == revision);
    assert_eq!(depth.shown.radiance, paused.shown.radiance);
    assert_eq!(depth.samples, paused.samples);
    let Some(LayerData::Scalar(values)) = &depth.shown.values else {
        panic!("depth is one value per pixel");
    };
    // The wall is 1.5 m ahead; the middle of the picture lies on it.
    let middle = values[45 * 160 + 80];
    assert!((middle - 1.5).abs() < 1e-5, "{middle}");
    assert!(depth.shown.legend.is_some_and(|l| l.unit == "m"));
    worker.set_paused(false);
    frame(&worker, |f| {
        f.activity == Activity::Refining && f.samples > paused.samples
    });
}

#[test]
fn a_target_error_ends_the_render_and_a_smaller_one_goes_on() {
    let (open, settings) = small();
    let goal = |target| Goal {
        samples_per_pixel: u64::MAX,
        target_error: Some(target),
    };
    let worker = worker(&settings, goal(0.5));
    worker.submit(job(1, &open, &settings));
    let done = frame(&worker, |f| f.activity == Activity::Done);
    let first = done.relative_error.expect("known");
    assert!(first <= 0.5);
    worker.set_goal(goal(0.5 * first));
    let done = frame(&worker, |f| {
        f.activity == Activity::Done && f.samples > done.samples
    });
    assert!(done.relative_error.expect("known") <= 0.5 * first);
}

#[test]
fn files_are_written_from_the_film() {
    let (open, settings) = small();
    let folder = tempfile::tempdir().expect("folder");
    let worker = worker(&settings, SHORT);
    worker.submit(job(1, &open, &settings));
    let done = frame(&worker, |f| f.activity == Activity::Done);
    let (exr, png) = (folder.path().join("a.exr"), folder.path().join("a.png"));
    let nowhere = folder.path().join("none/a.exr");
    for path in [&exr, &nowhere] {
        let path = path.clone();
        worker.export(Export::Exr { path, layers: None });
    }
    worker.export(Export::Photograph {
        path: png.clone(),
        seed: 0,
    });
    let mut news = Vec::new();
    let start = Instant::now();
    while news.len() < 3 && start.elapsed() < PATIENCE {
        news.extend(worker.news());
    }
    assert_eq!(news[0], News::Exported(exr.clone()));
    assert!(
        matches!(&news[1], News::NotExported(m) if m.contains("none")),
        "{news:?}"
    );
    assert_eq!(news[2], News::Exported(png.clone()));
    let written = uw_render::image::ExrImage::read(&exr).expect("readable");
    assert_eq!(written.picture.data, done.shown.radiance);
    for layer in ["ambient", "lamp.left", "depth", "variance", "backscatter"] {
        assert!(written.layer(layer).is_some(), "{layer}");
    }
    let photograph = read_frame(&png).expect("readable");
    let shown = done
        .shown
        .image()
        .expect("on the host")
        .pixels
        .iter()
        .flat_map(|p| [p.r(), p.g(), p.b()]);
    assert_eq!(
        photograph.counts,
        uw_render::image::Counts::Bits8(shown.collect())
    );
}

#[test]
fn water_that_cannot_be_is_answered_and_the_worker_lives() {
    let (open, mut settings) = small();
    let good = settings.clone();
    let worker = worker(&settings, SHORT);
    if let Some(water) = &mut settings.water {
        water.coefficients = Coefficients::Jerlov {
            scale: 0.0,
            bands: uw_viewer::model::WaterBands::SpectralMeasured,
        };
    }
    worker.submit(job(1, &open, &settings));
    let start = Instant::now();
    let news = loop {
        if let Some(news) = worker.news() {
            break news;
        }
        assert!(start.elapsed() < PATIENCE);
    };
    assert!(
        matches!(&news, News::Failed { generation: 1, message } if message.contains("measured")),
        "{news:?}"
    );
    worker.submit(job(2, &open, &good));
    assert_eq!(
        frame(&worker, |f| f.activity == Activity::Done).generation,
        2
    );
}
