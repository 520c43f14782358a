//! A scene for tests: an even target under the vehicle's lamps.

use uw_render::scene::{Scene, Texture, TextureFilter};

use crate::environment::{Target, View, WaterBody, scene};
use uw_calib::vehicle::Vehicle;
use uw_scenery::textures::Pattern;

/// Reflectance of the target.
const REFLECTANCE: f32 = 0.5;

/// A view from `distance_m` in water of a Jerlov type.
pub(super) fn even_target(jerlov: &str, backscatter_fraction: f64, distance_m: f64) -> Scene {
    let texture = Texture {
        width: 1,
        height: 1,
        texels: vec![[REFLECTANCE; 3]].into(),
        filter: TextureFilter::Nearest,
    };
    let target = Target {
        pattern: Pattern::Seabed,
        texture,
    };
    let body = WaterBody {
        jerlov: jerlov.parse().unwrap(),
        backscatter_fraction,
    };
    let view = View::Target {
        depth_m: 5.0,
        distance_m,
    };
    scene(&Vehicle::default(), &body, &target, view).unwrap()
}
