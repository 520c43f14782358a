//! Pictures do not depend on the unit of length: the same optics with lengths × s and coefficients / s.

use std::path::Path;

use uw_render::{
    film::{Film, FilmLayer},
    scene::{Mesh, Scene},
};
use uw_tests::{
    file,
    gpu::{Backend, PROCESSOR, backends},
    plan,
};

/// Scales besides 1.
const SCALES: [f64; 4] = [1e-3, 10.0, 1e3, 1e4];
/// Two batches.
const SAMPLES: u32 = 32;
/// Standard errors by which means may differ.
const LARGEST_Z: f64 = 3.0;
/// Relative difference of estimated errors.
const ERROR_WITHIN: f64 = 0.1;
/// With one seed the samples are the same but for rounding. How far a pixel may be off, relative to it and to the mean, and
/// the share of pixels that may be further apart: of 32 samples of a pixel some have walks that go another way, where a
/// random number lies within the rounding of a decision. From the air, where walks are copied most, 8 % were seen.
const SAME_WITHIN: (f64, f64) = (1e-3, 1e-5);
const DIFFERENT_SHARE: f64 = 0.2;

const CAMERA: &str = "position_m = [0.0, 0.0, 0.0], forward = [1.0, 0.0, 0.0], hfov_deg = 60.0, width = 20, height = 12";
const TARGET: &str = r#"
[[object]]
plane = { center_m = [1.5, 0.0, 0.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [1.6, 1.2] }
reflectance = { texture = "target_tex.png", encoding = "linear", filter = "nearest", tile_m = [2.0, 2.0] }
[[object]]
plane = { center_m = [0.0, 0.0, -1.0], normal = [0.0, 0.0, 1.0], up = [0.0, 1.0, 0.0], size_m = [8.0, 8.0] }
reflectance = [0.2, 0.4, 0.9]
"#;

fn lamp(name: &str, position: [f64; 3], radius: f64) -> String {
    let half_angle = if radius > 0.0 { 90 } else { 70 };
    format!(
        "[[lamp]]\nname = \"{name}\"\nposition_m = {position:?}\nforward = [1.0, 0.0, 0.0]\nintensity = [10.0, 8.0, 6.0]\n\
         half_angle_deg = {half_angle}\nradius_m = {radius:?}\n"
    )
}

fn parsed(camera: &str, rest: &str) -> Scene {
    let text = format!("format = \"uw-scene/1\"\ncamera = {{ {camera} }}\n{rest}{TARGET}");
    let folder = file("scenes");
    Scene::parse(&text, Path::new(&folder), "units").unwrap_or_else(|e| panic!("{e}"))
}

const WATER: &str = "water = { a = [0.25, 0.2, 0.3], b = [0.4, 0.5, 0.3], phase = { model = \"fournier-forand\", \
                     n = 1.10, backscatter_fraction = 0.0183 } }\n";
const DAYLIGHT: &str = "surface = { height_m = 1.0 }\nsky = { radiance = [0.1, 0.2, 0.3] }\n\
                        sun = { zenith_deg = 30.0, azimuth_deg = 40.0, irradiance = [1.0, 0.9, 0.8] }\n";

/// One of the surfaces of the scene as two triangles.
fn as_mesh(scene: &mut Scene, quad: usize) {
    let quad = scene.quads.remove(quad);
    let corner = |u: f64, v: f64| quad.centre_m + u * quad.half_u + v * quad.half_v;
    scene.meshes.push(Mesh {
        positions: vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: quad.material,
        ..Mesh::default()
    });
}

/// A lamp before a target at one optical depth; water that absorbs little, lit by a disk; three lamps; daylight with more
/// lamps than a walk is joined to; the same from the air; open water.
fn scenes() -> Vec<(&'static str, Scene)> {
    let beside = lamp("beside", [0.0, -0.3, 0.0], 0.0);
    let disk = lamp("disk", [0.2, 0.4, 0.1], 0.05);
    let three = format!("{beside}{disk}{}", lamp("far", [0.5, 1.0, 0.8], 0.0));
    let five = format!(
        "{three}{}{}",
        lamp("low", [0.3, -0.8, -0.5], 0.02),
        lamp("behind", [-1.0, 0.2, 0.3], 0.0)
    );
    let lossy = WATER.replace("[0.25, 0.2, 0.3]", "[0.02, 0.015, 0.02]");
    let from_air = CAMERA
        .replace("[0.0, 0.0, 0.0]", "[-0.5, 0.0, 1.5]")
        .replace("[1.0, 0.0, 0.0]", "[1.0, 0.0, -0.8]");
    let mut daylight = parsed(CAMERA, &format!("{WATER}{DAYLIGHT}{five}"));
    as_mesh(&mut daylight, 1);
    let mut open = parsed(CAMERA, &format!("{WATER}{beside}"));
    open.quads.clear();
    vec![
        ("one lamp", parsed(CAMERA, &format!("{WATER}{beside}"))),
        ("albedo 0.97", parsed(CAMERA, &format!("{lossy}{disk}"))),
        ("three lamps", parsed(CAMERA, &format!("{WATER}{three}"))),
        ("five lamps and daylight", daylight),
        (
            "from the air",
            parsed(&from_air, &format!("{WATER}{DAYLIGHT}{disk}")),
        ),
        ("open water", open),
    ]
}

/// The scene with lengths × `s` that shows the same radiance.
fn scaled(scene: &Scene, s: f64) -> Scene {
    let mut scene = scene.clone();
    scene.camera.position_m *= s;
    if let Some(water) = &mut scene.water {
        water.iops.a = water.iops.a.map(|a| a / s);
        water.iops.b = water.iops.b.map(|b| b / s);
    }
    if let Some(surface) = &mut scene.surface {
        surface.height_m *= s;
    }
    for lamp in &mut scene.lamps {
        lamp.position_m *= s;
        lamp.radius_m *= s;
        // Irradiance falls with the square of the distance.
        lamp.intensity = lamp.intensity.map(|i| i * s * s);
    }
    for quad in &mut scene.quads {
        quad.centre_m *= s;
        quad.half_u *= s;
        quad.half_v *= s;
        quad.tile_m *= s;
    }
    for position in scene.meshes.iter_mut().flat_map(|m| &mut m.positions) {
        *position *= s;
    }
    scene
}

/// Share of the pixels in which two pictures of one seed differ.
fn different(ours: &Film, theirs: &Film) -> f64 {
    let (ours, theirs) = (ours.layer(FilmLayer::Total), theirs.layer(FilmLayer::Total));
    let mean = theirs.iter().flatten().sum::<f64>() / (3 * theirs.len()) as f64;
    let (relative, absolute) = SAME_WITHIN;
    let apart = |(a, b): &(&[f64; 3], &[f64; 3])| {
        (0..3).any(|k| (a[k] - b[k]).abs() > relative * b[k] + absolute * mean)
    };
    ours.iter().zip(&theirs).filter(apart).count() as f64 / ours.len() as f64
}

fn assert_same(what: &str, ours: &Film, theirs: &Film) {
    let (mean, expected) = (ours.mean(), theirs.mean());
    let (variance, expected_variance) = (ours.variance_of_mean(), theirs.variance_of_mean());
    let z: [f64; 3] = std::array::from_fn(|k| {
        (mean[k] - expected[k]) / (variance[k] + expected_variance[k]).sqrt()
    });
    let error = |film: &Film| film.relative_error().expect("two batches");
    let ratio = error(ours) / error(theirs);
    let share = different(ours, theirs);
    println!("{what}: z {z:.2?}, error ratio {ratio:.3}, different pixels {share:.3}");
    assert!(z.iter().all(|z| z.abs() < LARGEST_Z), "{what}: z {z:?}");
    assert!(
        (ratio - 1.0).abs() < ERROR_WITHIN,
        "{what}: {ratio} times the error"
    );
    assert!(
        share <= DIFFERENT_SHARE,
        "{what}: {share} of the pixels differ"
    );
}

fn compare_at(backends: &[Backend]) {
    for (name, scene) in scenes() {
        for backend in backends {
            let render = |s: f64| backend.render(&scaled(&scene, s), &plan(SAMPLES, 3)).0;
            let theirs = render(1.0);
            for s in SCALES {
                let what = format!("{name} × {s:e}, {}", backend.name());
                assert_same(&what, &render(s), &theirs);
            }
        }
    }
}

#[test]
fn pictures_do_not_depend_on_the_unit_of_length() {
    compare_at(&PROCESSOR);
}

#[test]
fn pictures_by_the_adapter_do_not_depend_on_the_unit_of_length() {
    let adapters: Vec<_> = backends()
        .into_iter()
        .filter(|backend| matches!(backend, Backend::Adapter))
        .collect();
    compare_at(&adapters);
}
