//! Pictures know neither the directions of the axes nor the unit of radiance.

use glam::{DQuat, DVec3};
use uw_media::phase::{FournierForand, Phase};
use uw_render::{
    film::FilmLayer,
    scene::{Scene, Sun},
};
use uw_tests::{
    gpu::{Backend, everywhere},
    measure, plan,
    single_ray::{add_plate, camera, empty, point_lamp, surface, water},
};

/// Brightness of sources by that of the scenes: powers of two, so that of every number only the exponent changes.
const FACTORS: [f64; 2] = [1.0 / 8192.0, 8192.0];
/// How far a pixel may be from the multiple of another, relative.
const SAME_WITHIN: f64 = 1e-5;
/// Pixels that may be further away: where a random number lies within the rounding of a decision, a walk goes another way.
const DIFFERENT_SHARE: f64 = 0.01;

fn seen(from: DVec3, towards: DVec3) -> Scene {
    let mut scene = empty(camera(from, towards, 400));
    let phase = Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"));
    scene.water = Some(water([0.3, 0.1, 0.2], [0.6, 0.8, 1.0], phase));
    let (centre_m, normal) = (DVec3::new(1.5, 0.0, -1.0), DVec3::new(-1.0, 0.1, 0.2));
    add_plate(
        &mut scene,
        centre_m,
        normal.normalize(),
        0.8,
        [0.3, 0.5, 0.7],
    );
    scene
}

/// A point lamp and a disk before a plate in turbid water.
fn lamps() -> Scene {
    let mut scene = seen(DVec3::new(0.0, 0.0, -1.0), DVec3::new(1.0, 0.1, 0.05));
    for (y, radius_m) in [(-0.4, 0.0), (0.3, 0.1)] {
        let mut lamp = point_lamp(DVec3::new(0.1, y, -0.9), 4.0);
        (lamp.forward, lamp.half_angle_deg) = (DVec3::X, 60.0);
        lamp.radius_m = radius_m;
        scene.lamps.push(lamp);
    }
    scene.lamps[1].name = "disk".into();
    scene
}

/// The same plate under sun and sky.
fn daylight() -> Scene {
    let mut scene = seen(DVec3::new(0.0, 0.0, -1.0), DVec3::new(1.0, 0.1, 0.05));
    scene.surface = Some(surface(true));
    scene.sky_radiance = [0.1, 0.15, 0.2];
    scene.sun = Some(Sun {
        travel_direction: DVec3::new(0.6, 0.0, -0.8),
        irradiance: [1.0, 1.1, 1.2],
    });
    scene
}

/// The scene turned about the origin as a whole.
fn turned(scene: &Scene, turn: DQuat) -> Scene {
    let mut scene = scene.clone();
    let camera = &mut scene.camera;
    let quads = scene.quads.iter_mut();
    let lamps = scene.lamps.iter_mut();
    let vectors = [
        &mut camera.position_m,
        &mut camera.forward,
        &mut camera.right,
        &mut camera.down,
    ];
    let of_quads =
        quads.flat_map(|q| [&mut q.centre_m, &mut q.half_u, &mut q.half_v, &mut q.normal]);
    let of_lamps = lamps.flat_map(|l| [&mut l.position_m, &mut l.forward]);
    let of_sun = scene.sun.iter_mut().map(|s| &mut s.travel_direction);
    for vector in vectors
        .into_iter()
        .chain(of_quads)
        .chain(of_lamps)
        .chain(of_sun)
    {
        *vector = turn * *vector;
    }
    scene
}

/// The scene with all sources `factor` times as bright.
fn brightened(scene: &Scene, factor: f64) -> Scene {
    let mut scene = scene.clone();
    scene.sky_radiance = scene.sky_radiance.map(|l| l * factor);
    if let Some(sun) = &mut scene.sun {
        sun.irradiance = sun.irradiance.map(|e| e * factor);
    }
    for lamp in &mut scene.lamps {
        lamp.intensity = lamp.intensity.map(|i| i * factor);
    }
    scene
}

/// Means agree within their errors, whatever random numbers they are made of.
fn assert_same_means(backend: Backend, what: &str, scene: &Scene, other: &Scene) {
    let (one, one_error) = measure(backend, scene, 256, 0, 1);
    let (two, two_error) = measure(backend, other, 256, 0, 2);
    for k in 0..3 {
        let error = one_error[k].hypot(two_error[k]);
        let z = (one[k] - two[k]) / error;
        println!(
            "{what}, channel {k}: {} and {} ± {error}, z {z:+.2}",
            one[k], two[k]
        );
        assert!(
            error < 0.01 * backend.noise() * one[k],
            "{what}, channel {k}: error {error} of {}",
            one[k]
        );
        assert!(z.abs() < 4.5, "{what}, channel {k}: z {z}");
    }
}

/// With one seed every pixel of `other` is `factor` times that of `scene`.
fn assert_same_pixels(backend: Backend, what: &str, scene: &Scene, other: &Scene, factor: f64) {
    let pixels = |scene| {
        backend
            .render(scene, &plan(16, 3))
            .0
            .layer(FilmLayer::Total)
    };
    let (one, two) = (pixels(scene), pixels(other));
    let apart = |(a, b): &(&[f64; 3], &[f64; 3])| {
        (0..3).any(|k| (a[k] * factor - b[k]).abs() > SAME_WITHIN * b[k])
    };
    let different = one.iter().zip(&two).filter(apart).count();
    println!("{what}: {different} of {} pixels differ", one.len());
    assert!(
        different as f64 <= DIFFERENT_SHARE * one.len() as f64,
        "{what}: {different} of {} pixels differ",
        one.len()
    );
}

#[test]
fn a_scene_turned_as_a_whole_looks_the_same() {
    let anyhow = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 2.1);
    let about_the_vertical = DQuat::from_rotation_z(2.1);
    everywhere(|backend| {
        let (lamps, daylight) = (lamps(), daylight());
        assert_same_means(backend, "lamps", &lamps, &turned(&lamps, anyhow));
        let other = turned(&daylight, about_the_vertical);
        assert_same_means(backend, "daylight", &daylight, &other);
    });
}

#[test]
fn radiance_is_linear_in_that_of_all_sources() {
    everywhere(|backend| {
        for (name, scene) in [("lamps", lamps()), ("daylight", daylight())] {
            for factor in FACTORS {
                let what = format!("{name} {factor} times as bright");
                assert_same_pixels(backend, &what, &scene, &brightened(&scene, factor), factor);
            }
        }
    });
}
