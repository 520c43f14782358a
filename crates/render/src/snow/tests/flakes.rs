//! Flakes one by one: how many and how large they are, where they stay, what lens and shutter make of them.

use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};

use super::super::cloud::{Cloud, Flake};
use super::super::footprint::Flakes;
use super::super::{Source, View, of_view, snow};
use super::{opening, prepared, scene};
use crate::film::FilmLayer;
use crate::prepare::Prepared;
use crate::scene::{Blur, Scene, Snow};

const CLEAR: &str =
    "a = [0, 0, 0]\nb = [1e-6, 1e-6, 1e-6]\nphase = { model = \"isotropic\" }\nsnow = {}";

/// 400 clouds in 27 boxes whose faces lie anywhere in the cells: the variance over the mean is 1 within three of its
/// standard errors, and so is the mean; neighbouring boxes do not know of each other.
#[test]
fn the_number_of_flakes_is_poisson() {
    let snow = Snow {
        per_m3: 300.0,
        ..scene(CLEAR, "").snow.expect("snow")
    };
    let expected = 300.0 * 0.37_f64.powi(3);
    let (mut sum, mut squares, mut products, mut n) = (0.0, 0.0, 0.0, 0.0);
    for seed in 0..400 {
        let cloud = Cloud::new(&Snow { seed, ..snow });
        let mut before = None;
        for i in 0..27 {
            let corner =
                0.37 * DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) - 0.61;
            let excess = cloud.flakes_between(corner, corner + 0.37).len() as f64 - expected;
            sum += excess;
            squares += excess * excess;
            products += before.map_or(0.0, |before: f64| before * excess);
            before = Some(excess);
            n += 1.0;
        }
    }
    let error = (expected / n).sqrt();
    assert!(
        (sum / n).abs() < 3.0 * error,
        "mean {} ± {error} off",
        sum / n
    );
    let ratio = squares / n / expected;
    let of_ratio = ((2.0 + 1.0 / expected) / n).sqrt();
    assert!(
        (ratio - 1.0).abs() < 3.0 * of_ratio,
        "variance over mean {ratio} ± {of_ratio}"
    );
    let correlation = products / n / expected;
    assert!(
        correlation.abs() < 3.0 / n.sqrt(),
        "correlation {correlation}"
    );
}

/// The most likely slope of the sizes of some ten thousand flakes is that of the scene within 0.1, and their mean square what
/// the light is shared out by.
#[test]
fn sizes_follow_their_slope() {
    for slope in [1.0, 2.0, 3.0, 3.6] {
        let snow = Snow {
            slope,
            per_m3: 2e4,
            ..scene(CLEAR, "").snow.expect("snow")
        };
        let cloud = Cloud::new(&snow);
        let flakes = cloud.flakes_between(DVec3::ZERO, DVec3::ONE);
        let n = flakes.len() as f64;
        let [smallest, largest] = snow.diameter_m;
        assert!(
            flakes
                .iter()
                .all(|f| (smallest..=largest).contains(&f.diameter_m))
        );
        let mean_ln = flakes
            .iter()
            .map(|f| (f.diameter_m / smallest).ln())
            .sum::<f64>()
            / n;
        let span = (largest / smallest).ln();
        // The mean of ln x for a density of x^-s falls with s.
        let expected = |s: f64| {
            let weight = |i: i32| ((1.0 - s) * span * (f64::from(i) + 0.5) / 1e4).exp();
            let (sums, all) = (0..10_000).fold((0.0, 0.0), |(sum, all), i| {
                (
                    sum + weight(i) * span * (f64::from(i) + 0.5) / 1e4,
                    all + weight(i),
                )
            });
            sums / all
        };
        let (mut low, mut high) = (0.0, 8.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            *(if expected(middle) > mean_ln {
                &mut low
            } else {
                &mut high
            }) = middle;
        }
        assert!((low - slope).abs() < 0.1, "slope {low} instead of {slope}");
        let square = flakes.iter().map(|f| f.diameter_m.powi(2)).sum::<f64>() / n;
        // Squares spread by up to four times their mean.
        assert!((square / cloud.mean_square_m2() - 1.0).abs() < 3.0 * 4.0 / n.sqrt());
    }
}

/// A scene of 600 × 400 pixels with a focal length of 500 that sees evenly bright water.
fn clear() -> Scene {
    let mut scene = scene(CLEAR, "");
    scene.quads.clear();
    scene.lamps.truncate(1);
    scene.lamps[0].half_angle_deg = 180.0;
    let camera = &mut scene.camera;
    (camera.width, camera.height) = (600, 400);
    (camera.focal_px, camera.centre_px) = (DVec2::splat(500.0), DVec2::new(300.0, 200.0));
    // Far behind the camera: as bright everywhere.
    scene.lamps[0].position_m = DVec3::new(-50.0, 0.0, -2.0);
    scene
}

/// What flakes of 1 mm around `place` in the camera's frame look like, each from where it would be sharp: their light, the
/// mean of its places and their variances in pixels, those of the pixels themselves taken off.
fn look(scene: &Scene, place: DVec3) -> (f64, DVec2, DVec2) {
    const FLAKES: u32 = 64;
    let prepared = prepared(scene, |_| ());
    let view = View::new(&prepared);
    let source = Source::new(&prepared, 0).expect("water");
    let snow = prepared.snow.expect("snow");
    let cloud = Cloud::new(&snow);
    let flakes: Flakes<'_> = of_view(&snow, &view, &source, &cloud, 100.0);
    let (mut light, mut sum, mut squares) = (0.0, DVec2::ZERO, DVec2::ZERO);
    for key in 0..FLAKES {
        let flake = Flake {
            position_m: DVec3::ZERO,
            diameter_m: 1e-3,
            key,
        };
        // Anywhere in a pixel.
        let within = DVec2::new(f64::from(key % 8) + 0.5, f64::from(key / 8) + 0.5) / 8.0;
        let place = place + (within * place.z / 500.0).extend(0.0);
        let sharp = DVec2::new(300.0, 200.0) + 500.0 * place.truncate() / place.z;
        let mut spots = Vec::new();
        flakes.add(&flake, place, &mut spots);
        for spot in spots {
            let column_row = [spot.pixel % 600, spot.pixel / 600].map(f64::from);
            let aside = DVec2::from_array(column_row) + 0.5 - sharp;
            let own = f64::from(spot.light[0]);
            light += own;
            sum += own * aside;
            squares += own * aside * aside;
        }
    }
    let mean = sum / light;
    let variance = squares / light - mean * mean - 1.0 / 12.0;
    (light / f64::from(FLAKES), mean, variance)
}

/// A thin lens makes a circle of aperture × focal length × |1 / focus - 1 / distance|: its variance along an axis is the
/// squared radius over 4, that of the flake's own disc over 6. Within 4 % and, for the few points of small ones, 0.02 px² (some 300 points: 0.01 px²).
#[test]
fn circles_are_those_of_a_thin_lens() {
    let mut scene = clear();
    for (aperture_m, distance_m) in [0.0, 0.01].into_iter().flat_map(|aperture_m| {
        let distances_m = [0.1, 0.25, 0.5, 0.8, 1.0, 1.25, 2.0, 4.0];
        distances_m.map(|distance_m| (aperture_m, distance_m))
    }) {
        scene.camera.opening = opening(aperture_m, 1.0);
        let place = DVec3::new(0.01, 0.02, distance_m);
        let (_, mean, variance) = look(&scene, place);
        let circle_px = aperture_m * 500.0 * f64::abs(1.0 - 1.0 / distance_m);
        let flake_px = 1e-3 * 500.0 / distance_m;
        let expected = circle_px * circle_px / 16.0 + flake_px * flake_px / 24.0;
        for variance in variance.to_array() {
            let off = (variance - expected).abs();
            assert!(
                off < 0.04 * expected + 0.02,
                "at {distance_m} m: {variance} instead of {expected} px²"
            );
        }
        // Three standard errors of the single points of the smallest.
        let off = mean.length();
        assert!(off < 0.12 + 0.01 * circle_px, "at {distance_m} m: {mean}");
    }
}

/// However large its picture is, and however it is drawn, the light of a flake falls as the squared distance from the camera
/// (and from the lamp 50 m behind it), and with the cosine of the sight. Within 1 %.
#[test]
fn light_of_a_flake_does_not_depend_on_its_blur() {
    let mut scene = clear();
    let mut light = |aperture_m: f64, distance_m: f64| {
        scene.camera.opening = opening(aperture_m, 1.0);
        let place = DVec3::new(0.01, 0.02, distance_m);
        let cosine = distance_m / place.length();
        cosine * (distance_m * (distance_m + 50.0)).powi(2) * look(&scene, place).0
    };
    let expected = light(0.0, 2.0);
    for (aperture_m, distance_m) in [
        (0.0, 0.1),
        (0.0, 0.5),
        (0.01, 0.1),
        (0.01, 0.4),
        (0.01, 1.0),
    ] {
        let found = light(aperture_m, distance_m);
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "{} at {distance_m} m",
            found / expected
        );
    }
}

/// A flake behind the post that its pixel sees is hidden, one before it is not, drawn by points or as a disc.
#[test]
fn surfaces_hide_flakes() {
    let mut scene = scene(CLEAR, "");
    // The post is 0.8 m ahead and 0.1 m to the left.
    for (aperture_m, distance_m, seen) in [
        (0.0, 0.79, true),
        (0.0, 0.81, false),
        (0.1, 0.4, true),
        (0.6, 1.6, false),
    ] {
        scene.camera.opening = opening(aperture_m, 1.0);
        let prepared = prepared(&scene, |_| ());
        let view = View::new(&prepared);
        let source = Source::new(&prepared, 0).expect("water");
        let snow = prepared.snow.expect("snow");
        let flakes = of_view(&snow, &view, &source, &Cloud::new(&snow), 100.0);
        let flake = Flake {
            position_m: DVec3::ZERO,
            diameter_m: 1e-3,
            key: 3,
        };
        let mut spots = Vec::new();
        let place = distance_m * DVec3::new(-0.125, 0.0, 1.0);
        flakes.add(&flake, place, &mut spots);
        let found = spots.iter().filter(|spot| spot.light[0] > 0.0).count();
        let column = |spot: &super::super::footprint::Spot| spot.pixel % 48;
        let on_post = spots.iter().filter(|spot| (17..20).contains(&column(spot)));
        assert_eq!(on_post.count() > 0, seen, "{distance_m} m, {found} pixels");
        assert!(found > 0 || !seen);
    }
}

/// A streak is as long as velocity × exposure × focal length / distance: its variance is the squared length over 12.
#[test]
fn streaks_are_as_long_as_the_way_of_the_exposure() {
    let scene = clear();
    let exposure_s = 0.02;
    for (distance_m, speed, aperture_m) in [
        (1.0, 2.0, 0.0),
        (0.5, 1.0, 0.0),
        (2.0, 8.0, 0.0),
        (0.5, 2.0, 0.01),
    ] {
        let mut moving = scene.clone();
        moving.camera.opening = opening(aperture_m, 1.0);
        let place = DVec3::new(0.02, 0.01, distance_m);
        let still = look(&moving, place);
        // Flakes to the left, the camera to the right.
        let right = moving.camera.right;
        let snow = moving.snow.as_mut().expect("snow");
        snow.drift_m_s = -0.25 * speed * right;
        snow.blur = Blur {
            exposure_s,
            velocity_m_s: 0.75 * speed * right,
        };
        let (light, mean, variance) = look(&moving, place);
        let length_px = speed * exposure_s * 500.0 / distance_m;
        let found = (12.0 * (variance.x - still.2.x)).sqrt();
        let off = (found / length_px - 1.0).abs();
        assert!(off < 0.01, "{found} instead of {length_px} px");
        let across = (variance.y - still.2.y).abs();
        assert!(across < 0.02 + 0.02 * still.2.y, "{across} px² wider");
        assert!((mean.x + 0.5 * length_px).abs() < 0.01 * length_px);
        // Seen from the side the water's own light differs a little along the streak.
        assert!(
            (light / still.0 - 1.0).abs() < 0.01,
            "{light} instead of {}",
            still.0
        );
    }
}

/// Two cameras see a flake where it is, and later where it has drifted to.
#[test]
fn flakes_stay_where_they_are() {
    let mut scene = clear();
    // A wall at 2 m, so that there are not flakes behind flakes all over.
    scene.quads = super::scene(CLEAR, "").quads.split_off(1);
    let water = scene.snow.as_mut().expect("snow");
    (water.share, water.per_m3, water.drift_m_s) = (1.0, 200.0, DVec3::new(0.02, -0.03, 0.05));
    let mut moved = scene.clone();
    moved.camera.position_m += DVec3::new(0.1, 0.05, 0.02);
    let later = |scene: &Scene| {
        let mut later = scene.clone();
        later.snow.as_mut().expect("snow").time_s = 2.5;
        later
    };
    let cloud = Cloud::new(&scene.snow.expect("snow"));
    let seen_m = DVec3::new(1.0, 0.0, -2.0);
    let flakes = cloud.flakes_between(seen_m - 0.3, seen_m + 0.3);
    assert!(flakes.len() > 20);
    for (scene, drifted_m) in [
        (&scene, DVec3::ZERO),
        (&moved, DVec3::ZERO),
        (&later(&scene), DVec3::new(0.05, -0.075, 0.125)),
        (&later(&moved), DVec3::new(0.05, -0.075, 0.125)),
    ] {
        let of_scene = Cloud::new(&scene.snow.expect("snow"));
        let there = of_scene.flakes_between(seen_m + drifted_m - 0.3, seen_m + drifted_m + 0.3);
        assert_eq!(there.len(), flakes.len());
        let prepared = Prepared::build(scene);
        let layers = snow(&prepared, false, &AtomicBool::new(false)).expect("seen");
        let mut change = vec![[0.0; 3]; 600 * 400];
        layers.add_to(FilmLayer::Total, &mut change);
        let dark = change.iter().filter(|c| c[1] < 0.0).count();
        assert!(
            dark > 600 * 400 * 9 / 10,
            "most pixels see no flake, {dark} do not"
        );
        for (flake, own) in flakes.iter().zip(&there) {
            let place = flake.position_m + drifted_m;
            assert!(own.position_m.distance(place) < 1e-9 && own.diameter_m == flake.diameter_m);
            let Some(at) = scene.camera.project(place) else {
                continue;
            };
            if at.x > 0.0 && at.y > 0.0 && at.x < 600.0 && at.y < 400.0 {
                let pixel = at.y as usize * 600 + at.x as usize;
                let brightest = [0, 1, 599, 600, 601]
                    .iter()
                    .flat_map(|step| [pixel.checked_sub(*step), Some(pixel + step)]);
                let lit = brightest
                    .flatten()
                    .any(|p| change.get(p).is_some_and(|c| c[1] > 0.0));
                assert!(lit, "a flake of {} m at {place}", flake.diameter_m);
            }
        }
    }
}
