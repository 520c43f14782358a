//! Chosen extremes: those that chance would seldom bring together.

use glam::DVec3;
use uw_render::{
    film::FilmLayer,
    scene::{Texture, TextureFilter},
};
use uw_tests::{
    gpu::{Backend, everywhere},
    plan,
};

use super::extreme::{Extreme, Loss, Shape, Wall};
use super::unsound;

/// A metre of turbid water, nothing of which is extreme.
fn ordinary() -> Extreme {
    Extreme {
        law_index: 1.1,
        backscatter: 0.0183,
        peaked: true,
        ln_a: [-1.0, -2.0, -1.5],
        ln_b: [0.0, 0.5, 0.2],
        loss: Loss::Both,
        water_index: 1.34,
        scale_m: 1.0,
        offset_m: 0.0,
        camera_depth: 0.3,
        lamp: 4,
        lamp_radius: 0.0,
        surface: Some(true),
        sun_zenith_deg: 45.0,
        sky: 0.1,
        reflectance: 0.5,
        textured: false,
        shape: Shape::Triangle,
        wall: Wall::None,
        seed: 1,
    }
}

fn assert_sound(backend: Backend, extreme: &Extreme) {
    let (film, _) = backend.render(&extreme.scene(), &plan(16, extreme.seed));
    assert_eq!(unsound(&film), None, "{extreme:?}");
}

#[test]
fn lamps_of_any_size_anywhere() {
    everywhere(assert_any_lamp);
}

fn assert_any_lamp(backend: Backend) {
    for lamp in 0..5 {
        for lamp_radius in [1e-6, 1e2] {
            for surface in [None, Some(true)] {
                assert_sound(
                    backend,
                    &Extreme {
                        lamp,
                        lamp_radius,
                        surface,
                        ..ordinary()
                    },
                );
            }
        }
    }
}

#[test]
fn phase_functions_at_their_limits() {
    everywhere(assert_limits_of_phase_functions);
}

fn assert_limits_of_phase_functions(backend: Backend) {
    for law_index in [1.001_000_1, 1.01, 1.5] {
        for backscatter in [1e-4, 0.499] {
            assert_sound(
                backend,
                &Extreme {
                    law_index,
                    backscatter,
                    ..ordinary()
                },
            );
        }
    }
}

/// Coefficients of 1e3 1/m and of nothing, with a target at 1 mm, at 1 m and at 1 km.
#[test]
fn coefficients_at_their_limits_at_every_range() {
    everywhere(assert_limits_of_coefficients);
}

fn assert_limits_of_coefficients(backend: Backend) {
    let largest_per_m = 1e3f64;
    for scale_m in [1e-3, 1.0, 1e3] {
        let ln_largest = (largest_per_m * scale_m).ln();
        for (ln_a, ln_b, loss) in [
            (ln_largest, ln_largest, Loss::Both),
            (ln_largest, 0.0, Loss::AbsorptionOnly),
            (-30.0, ln_largest, Loss::Both),
            (ln_largest, -30.0, Loss::Both),
        ] {
            for surface in [None, Some(false), Some(true)] {
                assert_sound(
                    backend,
                    &Extreme {
                        ln_a: [ln_a; 3],
                        ln_b: [ln_b; 3],
                        loss,
                        scale_m,
                        surface,
                        ..ordinary()
                    },
                );
            }
        }
    }
}

#[test]
fn a_camera_inside_a_closed_wall_sees_nothing() {
    everywhere(assert_closed);
}

fn assert_closed(backend: Backend) {
    for scale_m in [1e-3, 1.0, 1e3] {
        for surface in [None, Some(true)] {
            let closed = Extreme {
                scale_m,
                surface,
                wall: Wall::AroundCamera,
                ..ordinary()
            };
            let (film, _) = backend.render(&closed.scene(), &plan(64, 1));
            assert_eq!(unsound(&film), None);
            let total = film.layer(FilmLayer::Total);
            assert!(
                total.iter().all(|p| *p == [0.0; 3]),
                "{scale_m} m, surface {surface:?}: {total:?}"
            );
        }
    }
}

/// A plate in whose plane the camera lies is not seen from there: what looks away from one of its sides sees what it
/// would if the plate were a hair behind.
#[test]
fn a_camera_in_the_plane_of_a_plate_sees_past_it() {
    everywhere(assert_seen_past);
}

fn assert_seen_past(backend: Backend) {
    let within = 1e-6 + backend.rounding();
    for (wall, rows) in [
        (Wall::AcrossView, [0, 2]),
        // Upwards with the plate below, downwards with the plate above.
        (Wall::AlongView, [0, 0]),
        (Wall::AlongView, [2, 2]),
    ] {
        let mut scene = Extreme { wall, ..ordinary() }.scene();
        // Only the lamp: whether a line of sunlight may be shadowed decides how many numbers are drawn.
        (scene.sun, scene.sky_radiance) = (None, [0.0; 3]);
        // Not in the plane itself, where both sides of the plate would see the lamp.
        let side = if rows == [2, 2] { -1.0 } else { 1.0 };
        scene.lamps[0].position_m += DVec3::new(0.2, 0.0, 0.2 * side);
        let touching = backend.render(&scene, &plan(64, 1)).0;
        assert_eq!(unsound(&touching), None);
        let plate = scene.quads.last_mut().expect("the wall");
        plate.centre_m -= 1e-9 * side * plate.normal;
        let beside = backend.render(&scene, &plan(64, 1)).0;
        let (touching, beside) = [&touching, &beside]
            .map(|film| film.layer(FilmLayer::Total))
            .into();
        for pixel in rows[0] * 4..rows[1] * 4 + 4 {
            for k in 0..3 {
                let (a, b): (f64, f64) = (touching[pixel][k], beside[pixel][k]);
                assert!((a - b).abs() < within * b, "{wall:?} {pixel}: {a} {b}");
            }
        }
    }
}

/// The largest textures cost memory, not correctness: a plate that shows one texel of them is as bright as that.
#[test]
fn textures_of_every_size() {
    everywhere(assert_textures);
}

fn assert_textures(backend: Backend) {
    let within = 1e-6 + backend.rounding();
    for (width, height) in [(1, 1), (8192, 8192), (16_384, 64), (1, 4096)] {
        // An adapter takes what fits into one of its bindings.
        if matches!(backend, Backend::Adapter) && width * height > 4096 * 4096 {
            continue;
        }
        let mut scene = ordinary().scene();
        scene.meshes.clear();
        scene.textures.push(Texture {
            width,
            height,
            texels: vec![[0.25, 0.5, 0.75]; (width * height) as usize].into(),
            filter: TextureFilter::Bilinear,
        });
        for material in &mut scene.materials {
            material.reflectance = [1.0; 3];
            material.texture = Some(0);
        }
        let textured = backend.render(&scene, &plan(16, 1)).0;
        for material in &mut scene.materials {
            material.reflectance = [0.25, 0.5, 0.75];
            material.texture = None;
        }
        // One that no surface has, so that walks choose among landings as they do before a texture.
        let mut unused = scene.materials[0].clone();
        unused.reflectance = [0.5; 3];
        scene.materials.push(unused);
        let plain = backend.render(&scene, &plan(16, 1)).0;
        assert_eq!(unsound(&textured), None);
        for k in 0..3 {
            let (a, b) = (textured.mean()[k], plain.mean()[k]);
            assert!((a - b).abs() < within * b, "{width} x {height}: {a} {b}");
        }
    }
}
