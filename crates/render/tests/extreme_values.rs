//! Numbers at the ends of what a scene file can write: refused, or rendered without a value that is not finite.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use uw_render::integrator::{Plan, render};
use uw_render::prepare::Prepared;
use uw_render::scene::Scene;

const SCENE: &str = r#"format = "uw-scene/1"
[water]
a = [0.3, A, 0.05]
b = [0.2, B, 0.1]
phase = { model = "henyey-greenstein", g = G }
[surface]
height_m = 3
[sun]
zenith_deg = 30
irradiance = [1, SUN, 1]
[sky]
radiance = [0.1, SKY, 0.1]
[camera]
position_m = [0, 0, 0]
forward = [1, 0, 0]
fx = FX
width = 4
height = 3
[[lamp]]
name = "left"
position_m = [0, 0.5, 0]
forward = [1, 0, 0]
intensity = [LAMP, LAMP, LAMP]
level_pct = LEVEL
half_angle_deg = ANGLE
radius_m = RADIUS
[[object]]
plane = { center_m = [2, 0, 0], normal = [-1, 0, 0], size_m = [SIZE, SIZE] }
reflectance = { texture = "texture.png", tile_m = [TILE, TILE] }
emission = [GLOW, 0, 0]
"#;

/// Names in the scene above and an ordinary value of each.
const FIELDS: [(&str, &str); 14] = [
    ("A", "0.1"),
    ("B", "0.2"),
    ("G", "0.8"),
    ("SUN", "1"),
    ("SKY", "0.1"),
    ("FX", "4"),
    ("LAMP", "1"),
    ("LEVEL", "50"),
    ("ANGLE", "40"),
    ("RADIUS", "0.05"),
    ("SIZE", "8"),
    ("TILE", "0.5"),
    ("GLOW", "0.1"),
    ("", ""),
];

fn scene_with(field: &str, value: &str, folder: &Path) -> Result<Scene, String> {
    let mut text = SCENE.to_string();
    for (name, ordinary) in FIELDS.iter().filter(|(name, _)| !name.is_empty()) {
        let written = if *name == field { value } else { ordinary };
        // Names stand before or after what is no letter.
        for (before, after) in [(" ", "\n"), (" ", ","), ("[", ","), (" ", "]"), (" ", " ")] {
            text = text.replace(
                &format!("{before}{name}{after}"),
                &format!("{before}{written}{after}"),
            );
        }
    }
    Scene::parse(&text, folder, "extreme.toml").map_err(|error| error.to_string())
}

fn is_finite(scene: &Scene) -> bool {
    let plan = Plan {
        samples_per_pixel: Some(4),
        threads: Some(1),
        max_bounces: 8,
        ..Plan::new(1)
    };
    let (film, _) = render(
        &Prepared::build(scene),
        &plan,
        &AtomicBool::new(false),
        &|_| (),
    )
    .expect("rendered");
    film.mean().iter().all(|mean| mean.is_finite())
}

#[test]
fn extreme_values_are_refused_or_give_finite_pictures() {
    let folder = tempfile::tempdir().expect("folder");
    let texture =
        image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([(60 * x) as u8, (60 * y) as u8, 9]));
    texture
        .save(folder.path().join("texture.png"))
        .expect("saved");
    assert!(is_finite(
        &scene_with("", "", folder.path()).expect("an ordinary scene")
    ));
    let extremes = [
        "0.0",
        "5e-324",
        "1e-310",
        "1e-300",
        "1e-160",
        "1e-40",
        "1e-20",
        "1e-15",
        "1e-7",
        "0.9999999999999999",
        "1e7",
        "1e12",
    ];
    let mut refused = 0;
    for (field, _) in FIELDS {
        for value in extremes {
            match scene_with(field, value, folder.path()) {
                Ok(scene) => assert!(is_finite(&scene), "{field} = {value}"),
                Err(error) => {
                    refused += 1;
                    assert!(
                        error.contains("extreme.toml:") && error.contains(value),
                        "{field} = {value}: {error}"
                    );
                }
            }
        }
    }
    assert!(refused > 20, "{refused}");
}

#[test]
fn tiles_and_planes_have_a_least_size() {
    let folder = tempfile::tempdir().expect("folder");
    for (field, path) in [
        ("TILE", "object 1 reflectance.tile_m"),
        ("SIZE", "object 1 plane.size_m"),
    ] {
        let error = scene_with(field, "5e-324", folder.path()).expect_err("too small");
        assert!(
            error.ends_with(&format!("{path} must be >= 0.000001 m, got 5e-324")),
            "{error}"
        );
    }
}
