//! Every feature of the scene file and every phase function by the kernels in single against double precision, in small
//! pictures.

use std::path::Path;

use uw_render::{film::FilmLayer, scene::Scene};
use uw_tests::{
    file,
    gpu::{Backend, in_single_precision},
    plan, render,
    same_numbers::{PICTURE_SAMPLES, assert_same_pixels, assert_same_tiles},
};

use crate::gpu::compare;

const CAMERA: &str = "position_m = [0.0, 0.0, 0.0]\nforward = [1.0, 0.0, 0.0]";
const CLEAR: &str = "a = [0.35, 0.06, 0.025]\nb = [0.035, 0.04, 0.045]";
const TURBID: &str = "a = [0.45, 0.20, 0.35]\nb = [0.9, 1.0, 1.1]";
const FORWARD: &str = "{ model = \"fournier-forand\", n = 1.10, backscatter_fraction = 0.0183 }";
const LAMP: &str = "[[lamp]]\nname = \"l\"\nposition_m = [0.0, -0.3, 0.1]\nforward = [1.0, 0.1, 0.0]\n\
    intensity = [10.0, 8.0, 6.0]\nhalf_angle_deg = 50.0\n";
const PLATE: &str = "[[object]]\nplane = { center_m = [1.5, 0.0, 0.0], normal = [-1.0, 0.2, 0.1], \
    up = [0.0, 0.0, 1.0], size_m = [2.0, 2.0] }\nreflectance = [0.2, 0.5, 0.7]\n";
const SURFACE: &str = "[surface]\nheight_m = 0.8\n";
const SUN: &str = "[sun]\nzenith_deg = 35.0\nazimuth_deg = 60.0\nirradiance = [1.0, 1.1, 1.2]\n[sky]\nradiance = [0.1, 0.15, 0.2]\n";

/// A scene of 80 × 40 pixels (8 tiles) in water with `phase`, and `rest`.
fn scene(camera: &str, water: &str, phase: &str, rest: &str) -> Scene {
    let text = format!(
        "format = \"uw-scene/1\"\n[water]\n{water}\nphase = {phase}\n[camera]\n{camera}\nhfov_deg = 60.0\n\
         width = 80\nheight = 40\n{rest}"
    );
    Scene::parse(&text, &file("scenes"), "feature").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

#[test]
fn every_phase_function() {
    let backends = in_single_precision();
    let phases = [
        (
            "fournier-forand",
            "{ model = \"fournier-forand\", n = 1.10, backscatter_fraction = 0.005 }",
        ),
        (
            "henyey-greenstein",
            "{ model = \"henyey-greenstein\", g = 0.9 }",
        ),
        ("rayleigh", "{ model = \"rayleigh\" }"),
        ("isotropic", "{ model = \"isotropic\" }"),
        ("draine", "{ model = \"draine\", g = 0.8, alpha = 0.5 }"),
        ("petzold", "{ model = \"petzold\" }"),
    ];
    for (name, phase) in phases {
        let lamp = scene(CAMERA, TURBID, phase, &format!("{LAMP}{PLATE}"));
        compare(&backends, &format!("{name}, lamp"), &lamp, 8);
        let sun = scene(CAMERA, CLEAR, phase, &format!("{SURFACE}{SUN}{PLATE}"));
        compare(&backends, &format!("{name}, sun"), &sun, 8);
    }
}

#[test]
fn lamps_and_surfaces() {
    let backends = in_single_precision();
    let disk = LAMP.replace(
        "half_angle_deg = 50.0",
        "radius_m = 0.05\nfalloff = \"cosine\"",
    );
    let dim = LAMP
        .replace("half_angle_deg = 50.0", "level_pct = 30.0")
        .replace("-0.3", "0.4");
    let dim = dim.replace("\"l\"", "\"dim\"");
    let many: String = (0..7)
        .map(|i| {
            let lamp = LAMP.replace("\"l\"", &format!("\"l{i}\""));
            lamp.replace("-0.3", &format!("{:.1}", 0.2 * f64::from(i) - 0.6))
        })
        .collect();
    for (name, rest) in [
        ("disk lamp", format!("{disk}{PLATE}")),
        ("two lamps, one dim", format!("{LAMP}{dim}{PLATE}")),
        ("seven lamps", format!("{many}{PLATE}")),
        ("refracting surface", format!("{SURFACE}{LAMP}{PLATE}")),
        ("disk under the surface", format!("{SURFACE}{disk}{PLATE}")),
        ("no object", LAMP.to_owned()),
    ] {
        compare(&backends, name, &scene(CAMERA, TURBID, FORWARD, &rest), 8);
    }
}

#[test]
fn cameras_and_daylight() {
    let backends = in_single_precision();
    let above = "position_m = [0.0, 0.0, 1.5]\nforward = [1.0, 0.0, -1.0]";
    let up = "position_m = [0.0, 0.0, -3.0]\nforward = [1.0, 0.0, 1.0]";
    let lens = format!("{CAMERA}\ndistortion = [-0.2, 0.05, 0.001, -0.002, 0.0]");
    let fisheye = format!("{CAMERA}\nfisheye = [0.05, -0.01, 0.002, 0.0]");
    let flat = format!(
        "{CAMERA}\nport = {{ kind = \"flat\", distance_m = 0.02, thickness_m = 0.01, glass_index = 1.49 }}"
    );
    let dome = format!(
        "{CAMERA}\nport = {{ kind = \"dome\", radius_m = 0.05, thickness_m = 0.005, offset_m = [0.002, 0.0, -0.01] }}"
    );
    let ahead = LAMP.replace("[0.0, -0.3, 0.1]", "[0.8, -0.1, 0.05]");
    let high = PLATE.replace("size_m = [2.0, 2.0]", "size_m = [4.0, 4.0]");
    let matched = "[surface]\nheight_m = 0.8\nrefractive = false\n";
    for (name, camera, rest) in [
        (
            "camera in the air",
            above,
            format!("{SURFACE}{SUN}{LAMP}{PLATE}"),
        ),
        ("looking up", up, format!("{SURFACE}{SUN}{PLATE}")),
        ("lens", &lens, format!("{LAMP}{PLATE}")),
        ("fisheye", &fisheye, format!("{LAMP}{PLATE}")),
        ("flat port", &flat, format!("{SURFACE}{SUN}{ahead}{PLATE}")),
        ("dome port", &dome, format!("{SURFACE}{SUN}{LAMP}{PLATE}")),
        (
            "plate through the surface",
            CAMERA,
            format!("{SURFACE}{SUN}{high}"),
        ),
        (
            "matched surface",
            CAMERA,
            format!("{matched}{SUN}{LAMP}{PLATE}"),
        ),
        (
            "emission",
            CAMERA,
            format!("{SURFACE}{SUN}{PLATE}emission = [0.3, 0.2, 0.1]\n"),
        ),
    ] {
        compare(&backends, name, &scene(camera, CLEAR, FORWARD, &rest), 8);
    }
}

#[test]
fn media_without_scattering_and_without_water() {
    let backends = in_single_precision();
    let absorbing = "a = [0.35, 0.06, 0.025]\nb = [0.0, 0.0, 0.0]";
    let red_only = "a = [0.35, 0.06, 0.025]\nb = [0.5, 0.0, 0.02]";
    for (name, water) in [("absorbing", absorbing), ("one channel clear", red_only)] {
        let rest = format!("{SURFACE}{SUN}{LAMP}{PLATE}");
        compare(&backends, name, &scene(CAMERA, water, FORWARD, &rest), 8);
    }
    let text = format!(
        "format = \"uw-scene/1\"\n[camera]\n{CAMERA}\nhfov_deg = 60.0\nwidth = 80\nheight = 40\n{SUN}{LAMP}{PLATE}"
    );
    let dry = Scene::parse(&text, Path::new("."), "dry").unwrap_or_else(|e| panic!("{e}"));
    compare(&backends, "no water", &dry, 8);
}

/// A bumpy mesh of 2 × 24 × 24 triangles with smooth normals and a texture in front of the camera.
fn add_mesh(scene: &mut Scene) {
    const N: u32 = 24;
    let mut mesh = uw_render::scene::Mesh {
        material: scene.quads[0].material,
        ..Default::default()
    };
    for j in 0..=N {
        for i in 0..=N {
            let (u, v) = (f64::from(i) / f64::from(N), f64::from(j) / f64::from(N));
            let bump = 0.05 * (9.0 * u).sin() * (7.0 * v).cos();
            mesh.positions.push(glam::DVec3::new(
                1.2 + bump,
                1.4 * (u - 0.5),
                1.2 * (v - 0.5),
            ));
            mesh.normals
                .push(glam::DVec3::new(-1.0, 0.3 * (9.0 * u).cos(), 0.0).normalize());
            mesh.uvs.push([u as f32, v as f32]);
        }
    }
    for j in 0..N {
        for i in 0..N {
            let k = j * (N + 1) + i;
            mesh.triangles.push([k, k + 1, k + N + 1]);
            mesh.triangles.push([k + 1, k + N + 2, k + N + 1]);
        }
    }
    scene.meshes.push(mesh);
}

#[test]
fn meshes_with_normals_and_textures() {
    let backends = in_single_precision();
    let textured = PLATE.replace(
        "reflectance = [0.2, 0.5, 0.7]",
        "reflectance = { texture = \"target_tex.png\", encoding = \"linear\" }",
    );
    let mut lamp = scene(CAMERA, CLEAR, FORWARD, &format!("{LAMP}{textured}"));
    add_mesh(&mut lamp);
    compare(&backends, "mesh, lamp", &lamp, 8);
    let mut sun = scene(CAMERA, CLEAR, FORWARD, &format!("{SURFACE}{SUN}{textured}"));
    add_mesh(&mut sun);
    compare(&backends, "mesh, sun", &sun, 8);
}

/// The pixels of each layer are the same; a lamp at level 0 has a layer too.
#[test]
fn layers_and_limits_on_bounces() {
    let backends = in_single_precision();
    let off = LAMP
        .replace("\"l\"", "\"off\"")
        .replace("half_angle_deg = 50.0", "level_pct = 0.0");
    let scene = scene(
        CAMERA,
        CLEAR,
        FORWARD,
        &format!("{SURFACE}{SUN}{LAMP}{off}{PLATE}"),
    );
    for max_bounces in [0, 1, 2] {
        let mut plan = plan(PICTURE_SAMPLES, 11);
        plan.dark_lamps = true;
        plan.max_bounces = max_bounces;
        let theirs = render(&scene, &plan).0;
        for layer in [
            FilmLayer::Ambient,
            FilmLayer::Lamp(0),
            FilmLayer::Lamp(1),
            FilmLayer::Direct,
            FilmLayer::Backscatter,
        ] {
            let light: f64 = theirs.layer(layer).iter().map(|v| v[1]).sum();
            assert!(light > 0.0, "{max_bounces}, {layer:?} is black");
        }
        for backend in &backends {
            let test = format!("{} at {max_bounces}", backend.name());
            let ours = backend.render(&scene, &plan).0;
            assert_same_tiles(&test, &ours, &theirs);
            assert_same_pixels(&test, &ours, &theirs);
        }
    }
}

/// What the comparisons above are worth: an absorption that is 0.3 % off is told apart.
#[test]
#[should_panic(expected = "with one seed, means")]
fn a_small_error_of_absorption_is_told() {
    let right = scene(CAMERA, TURBID, FORWARD, &format!("{LAMP}{PLATE}"));
    let mut wrong = right.clone();
    let water = wrong.water.as_mut().expect("water");
    water.iops.a = water.iops.a.map(|a| 1.003 * a);
    let plan = plan(8, 77);
    let [right, wrong] = [right, wrong].map(|scene| Backend::VectorUnits.render(&scene, &plan).0);
    assert_same_tiles("absorption", &wrong, &right);
}
