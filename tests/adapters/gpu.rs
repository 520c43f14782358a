//! Pictures by the kernels, on a graphics adapter and on the processor's vector units, against those in double precision with the
//! same random numbers: means and errors of tiles, and pixel by pixel.

use uw_render::{
    gpu::{AdapterChoice, Gpu},
    scene::Scene,
};
use uw_tests::{
    corpus_scene,
    gpu::{Backend, backends, device, in_single_precision},
    plan, render,
    same_numbers::{PICTURE_SAMPLES, assert_same_pixels, assert_same_tiles},
    tiles::{TILE, Tiles},
};

/// The scene at another size, with the same view.
fn resized(mut scene: Scene, width: u32, height: u32) -> Scene {
    let camera = &mut scene.camera;
    let factor = f64::from(width) / f64::from(camera.width);
    camera.focal_px *= factor;
    camera.centre_px *= factor;
    (camera.width, camera.height) = (width, height);
    scene
}

/// Renders on all sides with the same random numbers and compares; the completed samples are counted and no path may have been cut.
pub(crate) fn compare(backends: &[Backend], test: &str, scene: &Scene, samples: u32) {
    let plans = [plan(samples, 77), plan(PICTURE_SAMPLES, 11)];
    let [theirs, their_few] = plans.each_ref().map(|plan| render(scene, plan).0);
    for backend in backends {
        let test = format!("{test}, {}", backend.name());
        let [(ours, stats), (few, _)] = plans.each_ref().map(|plan| backend.render(scene, plan));
        println!(
            "{test}: {:.0} paths/s on {:?}",
            stats.paths as f64 / stats.render_s,
            stats.adapter,
        );
        assert_eq!(stats.samples_per_pixel, u64::from(samples));
        assert_eq!(stats.cut_paths, 0);
        assert_same_tiles(&test, &ours, &theirs);
        assert_same_pixels(&test, &few, &their_few);
    }
}

#[test]
fn clear_water_with_a_point_lamp() {
    compare(&in_single_precision(), "s1", &corpus_scene("s1_clear"), 16);
}

#[test]
fn clear_water_with_a_disk_lamp() {
    compare(
        &in_single_precision(),
        "s1d",
        &corpus_scene("s1d_clear_disk"),
        16,
    );
}

#[test]
fn turbid_water_with_a_point_lamp() {
    compare(&in_single_precision(), "s2", &corpus_scene("s2_turbid"), 16);
}

#[test]
fn daylight_over_a_plate() {
    compare(
        &in_single_precision(),
        "s3",
        &resized(corpus_scene("s3_sun"), 160, 90),
        16,
    );
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let scene = resized(corpus_scene("s2_turbid"), 2 * TILE as u32, TILE as u32);
    for backend in backends() {
        let pictures = [1, 2].map(|threads| {
            let mut plan = plan(4, 9);
            plan.threads = Some(threads);
            Tiles::of(&backend.render(&scene, &plan).0)
        });
        assert_eq!(pictures[0], pictures[1], "{}", backend.name());
    }
}

/// A program that renders picture by picture, in Python say, opens the adapter for each.
#[test]
fn the_adapter_can_be_opened_again_and_again() {
    if device().is_none() {
        return;
    }
    for count in 1..=64 {
        let opened = Gpu::open(AdapterChoice::Best);
        assert!(opened.is_ok(), "{count}: {:?}", opened.err());
    }
}
