//! Renders of the reference scenes against independently made pictures.

use uw_tests::{corpus_scene, plan, reference, render, tiles::{Tiles, spread}};

/// Renders `scene` and compares it with `reference`: picture mean within `mean_tolerance` (relative) and tiles
/// by z-test. 144 tiles per channel: rms of the z-scores within 1 ± 0.24 (four standard deviations of a
/// chi-squared with 144 degrees of freedom), none beyond 4.5 (chance 1 in 340 over all three channels).
fn compare(scene: &str, reference_name: &str, samples: u32, max_bounces: u32, mean_tolerance: f64) {
    let scene = corpus_scene(scene);
    let mut plan = plan(samples, 11);
    plan.max_bounces = max_bounces;
    let (film, stats) = render(&scene, &plan);
    let ours = Tiles::of(&film);
    let theirs = reference::tiles(reference_name);
    let ((mean, error), (expected, _)) = (ours.picture_mean(), theirs.picture_mean());
    println!("{reference_name}: {:.2} CPU s, relative error {:?}", stats.cpu_s, stats.relative_error);
    for k in 0..3 {
        let (rms, largest) = spread(&ours.z_scores(&theirs, k));
        let deviation = mean[k] / expected[k] - 1.0;
        println!("  channel {k}: mean {:+.5} ± {:.5}, z rms {rms:.3}, largest {largest:.2}", deviation, error[k] / expected[k]);
        assert!(deviation.abs() < mean_tolerance, "{reference_name} channel {k}: mean off by {deviation}");
        assert!(rms < 1.24 && rms > 0.5 && largest < 4.5, "{reference_name} channel {k}: z rms {rms}, largest {largest}");
    }
}

#[test]
fn one_event_in_clear_water() {
    compare("s1_clear", "one_event_s1", 256, 1, 1e-3);
}

#[test]
fn one_event_in_turbid_water() {
    compare("s2_turbid", "one_event_s2", 256, 1, 1e-3);
}

#[test]
fn clear_water_with_a_point_lamp() {
    compare("s1_clear", "s1", 64, 0, 5e-3);
}

#[test]
fn clear_water_with_a_disk_lamp() {
    compare("s1d_clear_disk", "s1d", 64, 0, 5e-3);
}

#[test]
fn turbid_water_with_a_point_lamp() {
    compare("s2_turbid", "s2", 64, 0, 5e-3);
}
