//! Snow against the water whose place it takes, and against what lens and shutter do.

mod flakes;
mod means;

use std::path::Path;

use crate::prepare::Prepared;
use crate::scene::{Opening, Scene, Snow};

/// Water, a post before the camera, a wall behind it, two lamps; `water` and `more` go into the tables.
fn scene(water: &str, more: &str) -> Scene {
    let text = format!(
        "format = \"uw-scene/1\"\n\
         {more}\n\
         [camera]\nposition_m = [0, 0, -2]\nforward = [1, 0, 0]\nhfov_deg = 60\nwidth = 48\nheight = 27\n\
         [[lamp]]\nposition_m = [0, 0.3, -1.9]\nforward = [1, -0.2, 0]\nintensity = [10, 8, 6]\nhalf_angle_deg = 50\n\
         [[lamp]]\nposition_m = [0, -0.3, -1.9]\nforward = [1, 0.1, 0]\nintensity = [5, 6, 7]\nlevel_pct = 60\n\
         half_angle_deg = 60\nradius_m = 0.03\n\
         [[object]]\nplane = {{ center_m = [0.8, 0.1, -2], normal = [-1, 0, 0], size_m = [0.15, 3] }}\n\
         reflectance = [0.3, 0.3, 0.3]\n\
         [[object]]\nplane = {{ center_m = [2, 0, -2], normal = [-1, 0, 0.3], up = [0, 0, 1], size_m = [9, 9] }}\n\
         reflectance = [0.3, 0.3, 0.3]\n\
         [water]\n{water}\n"
    );
    Scene::parse(&text, Path::new("."), "snow.toml").expect("valid")
}

/// The opening of a lens, none where it is 0.
fn opening(diameter_m: f64, focus_m: f64) -> Option<Opening> {
    (diameter_m > 0.0).then_some(Opening {
        diameter_m,
        focus_m,
    })
}

/// The scene with another seed of its cloud.
fn prepared(scene: &Scene, change: impl FnOnce(&mut Snow)) -> Prepared {
    let mut prepared = Prepared::build_unsteered(scene, Prepared::build(scene).geometry);
    change(prepared.snow.as_mut().expect("snow"));
    prepared
}
