//! A lens with an opening: edges out of focus against a closed form, focus behind ports, and pictures of all kinds of light against the
//! mean of pinholes all over the opening.

use glam::DVec2;
use uw_render::{
    film::{Film, FilmLayer},
    prepare::Prepared,
    scene::{Camera, Scene},
};
use uw_tests::{
    file,
    gpu::{Backend, everywhere},
    plan,
    same_numbers::assert_same_pictures,
    tiles::{Tiles, spread},
};

fn parsed(text: &str) -> Scene {
    Scene::parse(text, &file("scenes"), "lens").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// A half plane of radiance 1 at a distance, whose edge goes upright through the middle of the picture, in water that does nothing.
fn edge_at(distance_m: f64, camera: &str) -> Scene {
    parsed(&format!(
        "format = \"uw-scene/1\"\nwater = {{ a = [0, 0, 0], b = [0, 0, 0] }}\n\
         [camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\nwidth = 64\nheight = 8\n{camera}\n\
         [[object]]\nplane = {{ center_m = [{distance_m}, -5, 0], normal = [-1, 0, 0], size_m = [10, 10] }}\n\
         reflectance = [0, 0, 0]\nemission = [1, 1, 1]\n"
    ))
}

/// Means of the columns of the first channel.
fn columns(film: &Film) -> Vec<f64> {
    let pixels = film.layer(FilmLayer::Total);
    let width = film.width as usize;
    let mean = |column: usize| {
        let rows = pixels.iter().skip(column).step_by(width);
        rows.map(|pixel| pixel[0]).sum::<f64>() / f64::from(film.height)
    };
    (0..width).map(mean).collect()
}

/// The part of a disc of radius 1 to the left of a line at `x`.
fn disc_before(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    0.5 + (x * (1.0 - x * x).sqrt() + x.asin()) / std::f64::consts::PI
}

/// Before and behind the focus the circle has the radius focal length × aperture / 2 × |1 / distance - 1 / focus|: columns within 0.015
/// (2048 samples of each have a standard error of 0.011 at most, points of a sequence less).
#[test]
fn an_edge_out_of_focus_has_the_profile_of_a_disc() {
    let focal_px = 800.0;
    for (aperture_mm, focus_m, distance_m) in [
        (30.0, 1.0, 0.6),
        (30.0, 1.0, 3.0),
        (10.0, 0.5, 2.0),
        (30.0, 2.0, 2.0),
    ] {
        for lens in ["", "fisheye = [0.0, 0.0, 0.0, 0.0]\n"] {
            let camera =
                format!("fx = {focal_px}\n{lens}aperture_mm = {aperture_mm}\nfocus_m = {focus_m}");
            let scene = edge_at(distance_m, &camera);
            let radius_px =
                focal_px * 5e-4 * aperture_mm * f64::abs(1.0 / distance_m - 1.0 / focus_m);
            everywhere(|backend| {
                let found = columns(&backend.render(&scene, &plan(256, 7)).0);
                for (column, &found) in found.iter().enumerate() {
                    const PARTS: u32 = 64;
                    let at = |part: u32| {
                        let across =
                            column as f64 - 32.0 + (f64::from(part) + 0.5) / f64::from(PARTS);
                        disc_before(across / radius_px.max(1e-9))
                    };
                    let expected = (0..PARTS).map(at).sum::<f64>() / f64::from(PARTS);
                    assert!(
                        (found - expected).abs() < 0.015,
                        "{distance_m} m, focus {focus_m} m, {lens}column {column}: {found} instead of {expected}"
                    );
                }
            });
        }
    }
}

/// Columns that an edge takes from a tenth to nine tenths of its light.
fn blurred_columns(film: &Film) -> usize {
    let columns = columns(film);
    columns.iter().filter(|&&c| (0.1..0.9).contains(&c)).count()
}

/// Behind a port the lens is focused on what appears nearer than it is: an edge at `focus_m` is sharp, at half and twice the distance it is
/// not.
#[test]
fn what_is_in_focus_behind_a_port_is_sharp() {
    for port in [
        "port = { kind = \"flat\", distance_m = 0.05, thickness_m = 0.01 }",
        "port = { kind = \"dome\", radius_m = 0.08, thickness_m = 0.008, offset_m = 0 }",
        "port = { kind = \"dome\", radius_m = 0.08, thickness_m = 0.008, offset_m = -0.02 }",
    ] {
        let blurred = |distance_m: f64, backend: Backend| {
            let camera = format!("fx = 3000.0\naperture_mm = 20.0\nfocus_m = 1.0\n{port}");
            let scene = edge_at(distance_m, &camera);
            blurred_columns(&backend.render(&scene, &plan(256, 9)).0)
        };
        everywhere(|backend| {
            let widths = [0.5, 1.0, 2.0].map(|distance_m| blurred(distance_m, backend));
            println!("{port}: {widths:?} columns");
            assert!(widths[1] <= 2, "{port}: {widths:?}");
            assert!(widths[0] > 10 && widths[2] > 8, "{port}: {widths:?}");
        });
    }
}

/// Water that varies in three channels, lamps in view and behind things, a metal, sun and sky through a surface.
const MANY_LIGHTS: &str = "format = \"uw-scene/1\"\n\
    water = { a = [0.3, 0.2, 0.1], b = [0.6, 0.8, 0.5], phase = { model = \"fournier-forand\", n = 1.10, backscatter_fraction = 0.0183 } }\n\
    surface = {}\nsun = { zenith_deg = 30, azimuth_deg = 40, irradiance = [1, 1, 1] }\nsky = { radiance = [0.1, 0.12, 0.2] }\n\
    camera = { position_m = [0, 0, -1.2], forward = [1, 0, 0], hfov_deg = 60, width = 80, height = 60, aperture_mm = 120, focus_m = 0.7 }\n\
    [[lamp]]\nname = \"disk\"\nposition_m = [0, 0.3, -1.2]\nforward = [1, -0.2, 0]\nintensity = [2, 2, 2]\nhalf_angle_deg = 60\nradius_m = 0.03\n\
    [[lamp]]\nname = \"in_view\"\nposition_m = [1.4, 0.3, -1]\nforward = [-1, 0, 0]\nintensity = [0.3, 0.3, 0.3]\nhalf_angle_deg = 90\nradius_m = 0.05\n\
    [[object]]\nplane = { center_m = [1.8, 0, -1.2], normal = [-1, 0, 0.3], up = [0, 0, 1], size_m = [9, 9] }\nreflectance = [0.5, 0.3, 0.2]\n\
    [[object]]\nplane = { center_m = [0.5, 0.1, -1.3], normal = [-1, 0, 0], size_m = [0.1, 0.2] }\nreflectance = [0.8, 0.8, 0.8]\nroughness = 0.5\nmetallic = 1.0\n";

/// A pinhole at a point of the opening whose picture is shifted so that what is in focus stays in its place.
fn pinhole(camera: &Camera, on_opening: DVec2) -> Camera {
    let opening = camera.opening.expect("a lens");
    let aside_m = 0.5 * opening.diameter_m * on_opening;
    Camera {
        position_m: camera.position_m + aside_m.x * camera.right + aside_m.y * camera.down,
        centre_px: camera.centre_px + camera.focal_px * aside_m / opening.focus_m,
        opening: None,
        ..camera.clone()
    }
}

/// Points that fill the disc evenly (Vogel's spiral).
fn on_disc(count: u32) -> impl Iterator<Item = DVec2> {
    (0..count).map(move |i| {
        let radius = ((f64::from(i) + 0.5) / f64::from(count)).sqrt();
        radius * DVec2::from_angle(2.399_963_229_728_653 * f64::from(i))
    })
}

/// Every light that reaches a lens reaches one of the pinholes that it is made of. Tiles of the total: rms of z-scores at most 1.5, the
/// largest 4.5. That on the vector units; the pixels of other backends are theirs.
#[test]
fn a_lens_is_the_mean_of_its_pinholes() {
    const PINHOLES: u32 = 64;
    let scene = parsed(MANY_LIGHTS);
    let of_pinholes: Vec<Tiles> = on_disc(PINHOLES)
        .zip(100..)
        .map(|(on_opening, seed)| {
            let mut shifted = scene.clone();
            shifted.camera = pinhole(&scene.camera, on_opening);
            let backend = Backend::VectorUnits;
            Tiles::of(&backend.render(&shifted, &plan(16, seed)).0)
        })
        .collect();
    let n = f64::from(PINHOLES);
    let mut mean = of_pinholes[0].clone();
    for i in 0..mean.mean.len() {
        let sum = |value: fn(&Tiles, usize) -> [f64; 3], power: i32| {
            let of = |k: usize| {
                of_pinholes
                    .iter()
                    .map(|t| value(t, i)[k].powi(power))
                    .sum::<f64>()
            };
            [of(0), of(1), of(2)]
        };
        mean.mean[i] = sum(|t, i| t.mean[i], 1).map(|sum| sum / n);
        mean.standard_error[i] = sum(|t, i| t.standard_error[i], 2).map(|sum| sum.sqrt() / n);
    }
    let prepared = Prepared::build(&scene);
    everywhere(|backend| {
        if !matches!(backend, Backend::VectorUnits) {
            return assert_same_pictures(backend, "lens", &prepared, 0);
        }
        let film = backend.render_prepared(&prepared, &plan(512, 5)).0;
        let tiles = Tiles::of(&film).with_error(backend.rounding());
        let z: Vec<f64> = (0..3).flat_map(|k| tiles.z_scores(&mean, k)).collect();
        let (rms, largest) = spread(&z);
        println!("{} tiles: rms of z {rms:.2}, largest {largest:.2}", z.len());
        assert!(rms < 1.5 && largest < 4.5, "rms {rms}, largest {largest}");
    });
}
