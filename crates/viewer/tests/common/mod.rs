//! What the tests of the panels and the test of the memory share.

use std::time::Duration;

/// How long anything may take before a test gives up: a software driver that sees kernels for the first time translates them for a minute, on a busy
/// machine for two.
pub(crate) const PATIENCE: Duration = Duration::from_secs(300);

/// A small scene without files: a wall in clear water, one lamp, daylight.
pub(crate) const SCENE: &str = r#"format = "uw-scene/1"
water = { jerlov = "IB" }
surface = { height_m = 0.0 }
sun = { zenith_deg = 30.0, irradiance = [1.0, 1.0, 1.0] }
sky = { radiance = [0.1, 0.1, 0.1] }
camera = { position_m = [0.0, 0.0, -3.0], forward = [1.0, 0.0, 0.0], hfov_deg = 60.0, width = 160, height = 90 }
sensor = { exposure = 4.0 }
[[lamp]]
name = "left"
position_m = [0.0, 0.3, -3.0]
intensity = [1.0, 1.0, 1.0]
[[object]]
plane = { center_m = [1.5, 0.0, -4.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [4.0, 4.0] }
reflectance = [0.5, 0.4, 0.3]
"#;
