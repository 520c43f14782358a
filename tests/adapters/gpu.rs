//! Pictures by the kernels, on a graphics adapter and on the processor's vector units, against those in
//! double precision: with independent seeds by z-tests, with one seed pixel by pixel.

use uw_render::{
    film::Film,
    gpu::{AdapterChoice, Gpu},
    scene::Scene,
};
use uw_tests::{
    corpus_scene,
    gpu::{Backend, backends, device, in_single_precision},
    plan, render,
    same_numbers::{PICTURE_SAMPLES, assert_same_pixels},
    tiles::{TILE, Tiles, spread},
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

/// z-test of tiles and of the picture mean: the rms of the z-scores within four standard deviations of that of as many
/// normal numbers, none beyond 4.8 (chance 1 in 1500 in the largest picture here).
fn assert_same_picture(name: &str, ours: &Film, theirs: &Film) {
    let (ours, theirs) = (Tiles::of(ours), Tiles::of(theirs));
    let ((mean, error), (expected, expected_error)) = (ours.picture_mean(), theirs.picture_mean());
    let tiles = ours.mean.len() as f64;
    let band = 4.0 / (2.0 * tiles).sqrt();
    for k in 0..3 {
        let (rms, largest) = spread(&ours.z_scores(&theirs, k));
        let z = (mean[k] - expected[k]) / error[k].hypot(expected_error[k]);
        println!(
            "{name} channel {k}: mean {:+.5}, z {z:.2}, rms {rms:.3}, largest {largest:.2}",
            mean[k] / expected[k] - 1.0
        );
        assert!(
            z.abs() < 4.5,
            "{name} channel {k}: means {z} standard errors apart"
        );
        assert!(
            (rms - 1.0).abs() < band && largest < 4.8,
            "{name} channel {k}: z rms {rms} (1 ± {band}), largest {largest}"
        );
    }
}

/// Renders on all sides and compares; the completed samples are counted and no path may have been cut.
pub(crate) fn compare(backends: &[Backend], test: &str, scene: &Scene, samples: u32) {
    let (theirs, cpu) = render(scene, &plan(samples, 77));
    let same = plan(PICTURE_SAMPLES, 11);
    let theirs_with_one_seed = render(scene, &same).0;
    for backend in backends {
        let test = format!("{test}, {}", backend.name());
        let (film, stats) = backend.render(scene, &plan(samples, 5));
        println!(
            "{test}: {:.0} paths/s on {:?}, {:?}; double precision {:?}",
            stats.paths as f64 / stats.render_s,
            stats.adapter,
            stats.relative_error,
            cpu.relative_error
        );
        assert_eq!(stats.samples_per_pixel, u64::from(samples));
        assert_eq!(stats.cut_paths, 0);
        // Rare huge values would pass a z-test, because they raise the variance as well.
        let ratio =
            stats.relative_error.unwrap_or(f64::NAN) / cpu.relative_error.unwrap_or(f64::NAN);
        assert!(
            (0.4..2.5).contains(&ratio),
            "{test}: error {ratio} times that in double precision"
        );
        assert_same_picture(&test, &film, &theirs);
        let ours = backend.render(scene, &same).0;
        assert_same_pixels(&test, &ours, &theirs_with_one_seed);
    }
}

#[test]
fn clear_water_with_a_point_lamp() {
    compare(&in_single_precision(), "s1", &corpus_scene("s1_clear"), 64);
}

#[test]
fn clear_water_with_a_disk_lamp() {
    compare(
        &in_single_precision(),
        "s1d",
        &corpus_scene("s1d_clear_disk"),
        64,
    );
}

#[test]
fn turbid_water_with_a_point_lamp() {
    compare(&in_single_precision(), "s2", &corpus_scene("s2_turbid"), 64);
}

#[test]
fn daylight_over_a_plate() {
    compare(
        &in_single_precision(),
        "s3",
        &resized(corpus_scene("s3_sun"), 160, 90),
        64,
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
