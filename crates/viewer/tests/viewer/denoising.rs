//! The switch that shows the picture denoised.

use std::time::Instant;

use egui_kittest::kittest::Queryable;
use uw_render::image::ExrImage;
use uw_viewer::worker::{Activity, Export, Frame, Goal, View};

use crate::panels::{click, until, viewer};
use crate::support::{PATIENCE, frame, job, small, view, worker};

/// Mean squared difference of neighbours in green over the mean square.
fn roughness(frame: &Frame) -> f64 {
    let rows = frame.shown.radiance.chunks(frame.camera.width as usize);
    let (mut differences, mut squares) = (0.0, 0.0);
    for pair in rows.flat_map(|row| row.windows(2)) {
        let [one, other] = [pair[0][1], pair[1][1]].map(f64::from);
        differences += (other - one).powi(2);
        squares += one.powi(2);
    }
    differences / squares
}

#[test]
fn a_finished_picture_is_denoised_on_request_and_as_before_afterwards() {
    let (open, settings) = small();
    let goal = Goal {
        samples_per_pixel: 4,
        target_error: None,
    };
    let worker = worker(&settings, goal);
    worker.submit(job(1, &open, &settings));
    let noisy = frame(&worker, |f| f.activity == Activity::Done);
    assert!(noisy.denoised.is_none());

    worker.set_view(View {
        denoised: true,
        ..view(&settings)
    });
    let is_clean = |f: &Frame| f.activity == Activity::Done && f.denoised.is_some();
    let clean = frame(&worker, is_clean);
    // A second half with as many samples.
    assert_eq!((clean.generation, clean.samples), (1, 2 * noisy.samples));
    let facts = clean.denoised.expect("denoised");
    assert_eq!(clean.relative_error, Some(facts.relative_error));
    assert!(facts.relative_error > 0.0 && Some(facts.relative_error) < noisy.relative_error);
    let (rough, before) = (roughness(&clean), roughness(&noisy));
    assert!(rough < 0.5 * before, "{rough} {before}");

    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("clean.exr");
    worker.export(Export::Exr {
        path: path.clone(),
        layers: None,
    });
    let start = Instant::now();
    while worker.news().is_none() {
        assert!(start.elapsed() < PATIENCE, "no file came");
    }
    let written = ExrImage::read(&path).expect("readable");
    assert_eq!(written.picture.data, clean.shown.radiance);
    let label = written
        .attributes
        .iter()
        .find(|(name, _)| name == "uw.denoised");
    assert!(label.is_some_and(|(_, text)| text.contains("biased")));

    worker.set_view(view(&settings));
    let again = frame(&worker, |f| f.denoised.is_none());
    assert_eq!(again.shown.radiance, noisy.shown.radiance);
    assert_eq!(again.samples, noisy.samples);
}

#[test]
fn the_switch_is_off_at_first_and_what_it_shows_is_said_to_be_biased() {
    let mut harness = viewer();
    until(&mut harness, "a picture", |v| {
        v.is_current() && v.frame().is_some_and(|f| f.denoised.is_none())
    });
    assert!(harness.query_by_label_contains("biased").is_none());
    click(&mut harness, "View");
    // Its key stands beside its name.
    let switch = harness.get_by_label_contains("Denoise (biased)");
    switch.click_accesskit();
    until(&mut harness, "the denoised picture", |v| {
        v.frame().is_some_and(|f| f.denoised.is_some())
    });
    harness.run_steps(3);
    harness.get_by_label_contains("denoised (biased), estimated error");
    harness.state_mut().denoised = false;
    until(&mut harness, "the picture as it was", |v| {
        v.frame().is_some_and(|f| f.denoised.is_none())
    });
}
