//! The messages, as their `.msg` files have them.

use serde::{Deserialize, Serialize};

/// `builtin_interfaces/msg/Time`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Time {
    pub(super) sec: i32,
    pub(super) nanosec: u32,
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Header {
    pub(super) stamp: Time,
    pub(super) frame_id: String,
}

/// `std_msgs/msg/Float64`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Float64 {
    pub(super) data: f64,
}

/// `sensor_msgs/msg/Range`, up to what all releases have: newer ones have the variance at its end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Range {
    pub(super) header: Header,
    pub(super) radiation_type: u8,
    pub(super) field_of_view: f32,
    pub(super) min_range: f32,
    pub(super) max_range: f32,
    pub(super) range: f32,
}

/// `sensor_msgs/msg/FluidPressure`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FluidPressure {
    pub(super) header: Header,
    pub(super) fluid_pressure: f64,
    pub(super) variance: f64,
}

/// `sensor_msgs/msg/CompressedImage`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct CompressedImage {
    pub(super) header: Header,
    pub(super) format: String,
    pub(super) data: Vec<u8>,
}

/// `geometry_msgs/msg/Vector3`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Vector3 {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
}

/// `uwguide_msgs/msg/Suggestion`: `ros2/uwguide_msgs/msg/Suggestion.msg` says what the fields mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Suggestion {
    pub(super) header: Header,
    pub(super) valid: bool,
    pub(super) action: String,
    pub(super) reason: String,
    pub(super) message: String,
    pub(super) why: String,
    pub(super) warnings: Vec<String>,
    pub(super) distance_m: f64,
    pub(super) light_pct: f64,
    pub(super) level_pct: f64,
    pub(super) delta_distance_m: f64,
    pub(super) delta_light_pct: f64,
    pub(super) displacement: Vector3,
    pub(super) predicted_contrast: [f64; 3],
    pub(super) predicted_contrast_error: [f64; 3],
    pub(super) predicted_here: [f64; 3],
    pub(super) predicted_here_error: [f64; 3],
    pub(super) residual_here: [f64; 3],
    pub(super) residual_misfit: f64,
    pub(super) score: f64,
    pub(super) score_here: f64,
    pub(super) gain: f64,
    pub(super) predictor: String,
}
