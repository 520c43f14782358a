//! Lamps that the camera looks at, lamps that touch a surface, and many of them.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use uw_media::phase::{FournierForand, Phase};
use uw_render::{
    film::FilmLayer,
    scene::{Camera, Scene},
};
use uw_tests::{
    gpu::{Backend, PROCESSOR, everywhere, prepared},
    measure, plan,
    same_numbers::{PART, assert_same_radiances},
    single_ray::{add_plate, camera, empty, point_lamp, water},
    tails::{largest_share_in_steps, largest_share_of, only},
};

const A: [f64; 3] = [0.2, 0.1, 0.15];
const B: [f64; 3] = [0.5, 0.6, 0.45];
/// The pixel whose middle the lamp is close to.
const LAMP_PIXEL: (u32, u32) = (3, 2);
/// Root of the number of samples among which one may hold the variance.
const SAMPLES_ROOT: u32 = 256;

/// A camera of 8 × 6 pixels that looks along +x with 0.09 rad to the pixel.
fn wide_camera() -> Camera {
    Camera {
        width: 8,
        height: 6,
        focal_px: DVec2::splat(11.0),
        centre_px: DVec2::new(4.0, 3.0),
        ..camera(DVec3::ZERO, DVec3::X, 8)
    }
}

/// Water around a point lamp that the camera looks at.
fn lamp_in_view(phase: Phase) -> Scene {
    let mut scene = empty(wide_camera());
    scene.water = Some(water(A, B, phase));
    let (x, y) = (f64::from(LAMP_PIXEL.0) + 0.3, f64::from(LAMP_PIXEL.1) + 0.6);
    let position = 1.5 * scene.camera.direction(x, y);
    scene.lamps.push(point_lamp(position, 1.0));
    scene
}

fn peaked() -> Phase {
    Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"))
}

/// Isotropically once-scattered light of the scene's lamp along the ray through an image point, times its distance
/// from the lamp in pixels, which makes it smooth: with dt = r²/h dθ along the ray it is an integral over angles.
fn once_scattered(scene: &Scene, point: DVec2, distance_px: f64) -> [f64; 3] {
    const STEPS: u32 = 300;
    let iops = &scene.water.as_ref().expect("it is in water").iops;
    let lamp = scene.lamps[0].position_m;
    let direction = scene.camera.direction(point.x, point.y);
    let foot = lamp.dot(direction);
    let height = (lamp - foot * direction).length();
    let (start, end) = ((-foot / height).atan(), 0.5 * PI);
    let step = (end - start) / f64::from(STEPS);
    let mut sum = [0.0; 3];
    for i in 0..STEPS {
        let angle = start + (f64::from(i) + 0.5) * step;
        let way = foot + height * angle.tan() + height / angle.cos();
        for k in 0..3 {
            sum[k] += (-iops.c()[k] * way).exp() * step;
        }
    }
    std::array::from_fn(|k| sum[k] * iops.b[k] / (4.0 * PI) * distance_px / height)
}

/// Mean over the lamp's pixel, in polar coordinates about the lamp.
fn pixel_mean(scene: &Scene) -> [f64; 3] {
    const RADII: u32 = 100;
    const ANGLES: u32 = 400;
    let centre = scene
        .camera
        .project(scene.lamps[0].position_m)
        .expect("it is in view");
    let corner = DVec2::new(f64::from(LAMP_PIXEL.0), f64::from(LAMP_PIXEL.1));
    let mut sum = [0.0; 3];
    for i in 0..ANGLES {
        let towards = DVec2::from_angle(TAU * (f64::from(i) + 0.5) / f64::from(ANGLES));
        let to_edge = |c: f64, low: f64, d: f64| {
            if d > 0.0 {
                (low + 1.0 - c) / d
            } else {
                (low - c) / d
            }
        };
        let edge =
            to_edge(centre.x, corner.x, towards.x).min(to_edge(centre.y, corner.y, towards.y));
        for j in 0..RADII {
            let r = edge * (f64::from(j) + 0.5) / f64::from(RADII);
            let light = once_scattered(scene, centre + r * towards, r);
            for k in 0..3 {
                sum[k] += light[k] * edge / f64::from(RADII) * TAU / f64::from(ANGLES);
            }
        }
    }
    sum
}

/// Free paths are hundreds of metres long here and the light is within one of the lamp: drawn by free paths alone, a
/// sample in a thousand finds it.
#[test]
fn the_veil_of_clear_water_before_nothing_needs_few_samples() {
    let mut scene = empty(wide_camera());
    let b = [1e-3, 2e-3, 4e-3];
    scene.water = Some(water([0.37, 0.09, 0.02], b, Phase::Isotropic));
    scene
        .lamps
        .push(point_lamp(DVec3::new(0.0, -0.3, 0.0), 1.0));
    let mut once = plan(1024, 7);
    once.max_bounces = 1;
    everywhere(|backend| {
        let (film, _) = backend.render(&scene, &once);
        let (total, variance) = (
            film.layer(FilmLayer::Total),
            film.layer(FilmLayer::Variance),
        );
        for (i, (total, variance)) in total.iter().zip(variance).enumerate() {
            let (x, y) = (i % 8, i / 8);
            let middle = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            // Radiance in the middle for the pixel's mean: 1 % for its curvature.
            let expected = once_scattered(&scene, middle, 1.0);
            for k in 0..3 {
                let error = variance[k].sqrt();
                assert!(
                    error < 0.08 * total[k],
                    "{}, {x} {y}: {} ± {error}",
                    backend.name(),
                    total[k]
                );
                let off = (total[k] - expected[k]).abs();
                assert!(
                    off < 5.0 * error + 0.01 * expected[k],
                    "{}, {x} {y}, channel {k}: {} ± {error}, expected {}",
                    backend.name(),
                    total[k],
                    expected[k]
                );
            }
        }
    });
}

#[test]
fn light_scattered_once_around_a_lamp_in_view_is_its_integral() {
    let mut scene = lamp_in_view(Phase::Isotropic);
    let expected = pixel_mean(&scene);
    scene = only(&scene, LAMP_PIXEL);
    everywhere(|backend| {
        // An adapter makes the samples of a pixel one after the other.
        let (samples, most) = match backend {
            Backend::Adapter => (1 << 12, 0.03),
            _ => (1 << 20, 0.002),
        };
        let mut once = plan(samples, 5);
        once.max_bounces = 1;
        let (film, _) = backend.render(&scene, &once);
        let total = film.layer(FilmLayer::Total)[0];
        let error = film.layer(FilmLayer::Variance)[0].map(f64::sqrt);
        for k in 0..3 {
            let z = (total[k] - expected[k]) / error[k];
            println!(
                "{}, channel {k}: {} ± {}, {}",
                backend.name(),
                total[k],
                error[k],
                expected[k]
            );
            // Where image points closest to the lamp come from whole pixels only, the vector units have twice the error.
            assert!(error[k] < most * expected[k] && z.abs() < 4.0, "z {z}");
        }
    });
}

/// Image points about a lamp are drawn pixel by pixel, so that a pixel in parts, by which kernels show their samples, would
/// be another test. On an adapter, where single samples take too long, the integral above needs the same image points.
#[test]
fn a_point_lamp_in_view_has_no_heavy_tail() {
    for phase in [Phase::Isotropic, peaked()] {
        let scene = lamp_in_view(phase);
        let mut around = only(&scene, (LAMP_PIXEL.0 - 1, LAMP_PIXEL.1 - 1));
        (around.camera.width, around.camera.height) = (2, 2);
        for backend in PROCESSOR {
            let share = largest_share_in_steps(backend, &around, SAMPLES_ROOT * SAMPLES_ROOT);
            println!("lamp in view, {}: largest share {share:.4}", backend.name());
            assert!(share < 0.05, "{}: {share}", backend.name());
        }
    }
}

/// A lamp right in front of a plate that it does not shine on, in turbid water.
fn touching(gap_m: f64, radius_m: f64) -> Scene {
    let mut scene = empty(wide_camera());
    scene.camera.forward = DVec3::new(0.86, 0.5, 0.0).normalize();
    scene.camera.right = DVec3::new(0.5, -0.86, 0.0).normalize();
    scene.camera.down = -DVec3::Z;
    scene.camera.position_m = DVec3::new(1.0, -0.3, 0.0);
    scene.water = Some(water(A, [2.5, 2.6, 2.45], Phase::Isotropic));
    let mut lamp = point_lamp(DVec3::new(1.5 - gap_m, 0.0, 0.0), 1.0);
    lamp.forward = -DVec3::X;
    lamp.half_angle_deg = 90.0;
    lamp.radius_m = radius_m;
    scene.lamps.push(lamp);
    plate_ahead(&mut scene);
    scene
}

/// A plate across the view, 1.5 m along x.
fn plate_ahead(scene: &mut Scene) {
    add_plate(scene, DVec3::new(1.5, 0.0, 0.0), -DVec3::X, 4.0, [0.5; 3]);
}

/// Without the ways through the water close to the plate the share is 0.8 and more.
#[test]
fn a_disk_that_touches_a_surface_has_no_heavy_tail() {
    everywhere(|backend| {
        let scene = touching(1e-4, 0.1);
        let pixels = (0..8).map(|i| (2 + i % 4, 2 + i / 4));
        let pixels = pixels.take(backend.samples(8) as usize);
        let share = largest_share_of(backend, &scene, pixels, SAMPLES_ROOT);
        println!("touching: largest share {share:.4}");
        assert!(share < 0.1, "{share}");
    });
}

/// Many lamps are drawn from; their sum is that of the lamps one by one.
#[test]
fn many_lamps_add_up() {
    let mut scene = empty(camera(DVec3::ZERO, DVec3::X, 400));
    scene.water = Some(water(A, B, peaked()));
    plate_ahead(&mut scene);
    for i in 0..12 {
        let angle = f64::from(i);
        let position = DVec3::new(0.1 * angle, angle.cos(), angle.sin());
        let mut lamp = point_lamp(position, 1.0 + angle);
        lamp.forward = DVec3::X;
        lamp.half_angle_deg = 70.0;
        lamp.radius_m = if i % 2 == 0 { 0.05 } else { 0.0 };
        scene.lamps.push(lamp);
    }
    everywhere(|backend| assert_adds_up(backend, &scene));
}

/// So many are chosen by groups that lie together, half of them are not: under water whose surface mirrors them, beside lamps that are seen.
#[test]
fn lamps_in_groups_add_up_with_those_in_none() {
    let mut scene = empty(camera(DVec3::ZERO, DVec3::X, 400));
    scene.water = Some(water(A, B, peaked()));
    scene.surface = Some(uw_render::scene::WaterSurface {
        height_m: 1.7,
        refractive: true,
    });
    plate_ahead(&mut scene);
    for i in 0..160 {
        let angle = 0.7 * f64::from(i);
        let away_m = 0.3 + 0.01 * f64::from(i);
        let across = DVec3::new(0.0, angle.cos(), angle.sin());
        let mut lamp = point_lamp(away_m * across, 1.0 + 0.1 * angle);
        lamp.forward = DVec3::X;
        lamp.half_angle_deg = 70.0;
        if i % 4 == 0 {
            // In view, and turned to the camera.
            lamp.position_m = DVec3::X + 0.2 * across;
            lamp.forward = -DVec3::X;
            lamp.radius_m = 0.03;
            lamp.intensity = [0.05; 3];
        }
        scene.lamps.push(lamp);
    }
    everywhere(|backend| assert_parts_add_up(backend, &scene, 80));
}

/// The picture of all lamps is the sum of those of one.
fn assert_adds_up(backend: Backend, scene: &Scene) {
    assert_parts_add_up(backend, scene, 1);
}

/// The picture of all lamps is the sum of those of so many: on the vector units, whose pictures are those of other backends.
fn assert_parts_add_up(backend: Backend, scene: &Scene, count: usize) {
    const SAMPLES: u32 = 256;
    let parts = scene.lamps.chunks(count).map(|lamps| Scene {
        lamps: lamps.to_vec(),
        ..scene.clone()
    });
    if !matches!(backend, Backend::VectorUnits) {
        for (scene, seed) in std::iter::once(scene.clone()).chain(parts).zip(1..) {
            let sampled = (SAMPLES / PART, 0, seed);
            assert_same_radiances(backend, "lamps", &prepared(&scene), sampled);
        }
        return;
    }
    let (together, error) = measure(backend, scene, SAMPLES, 0, 1);
    let (mut sum, mut variance) = ([0.0; 3], [0.0; 3]);
    for (part, seed) in parts.zip(2..) {
        let (mean, error) = measure(backend, &part, SAMPLES, 0, seed);
        for k in 0..3 {
            sum[k] += mean[k];
            variance[k] += error[k] * error[k];
        }
    }
    for k in 0..3 {
        let z = (together[k] - sum[k]) / error[k].hypot(variance[k].sqrt());
        println!(
            "channel {k}: {} ± {}, one by one {}",
            together[k], error[k], sum[k]
        );
        assert!(error[k] < 0.005 * sum[k] && z.abs() < 4.0, "z {z}");
    }
}
