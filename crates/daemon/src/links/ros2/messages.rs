//! The messages, as their `.msg` files have them.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// A message with the package and the name of its type.
pub(super) trait Message: DeserializeOwned + Send + Sync + 'static {
    const TYPE: (&'static str, &'static str);
}

macro_rules! types {
    ($($package:literal: $($name:ident),+;)+) => {
        $($(impl Message for $name {
            const TYPE: (&'static str, &'static str) = ($package, stringify!($name));
        })+)+
    };
}

types! {
    "geometry_msgs": PoseStamped, PoseWithCovarianceStamped;
    "nav_msgs": Odometry;
    "sensor_msgs": CompressedImage, FluidPressure, Image, Range;
    "std_msgs": Float32, Float64;
    "uwguide_msgs": Suggestion;
}

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

/// `std_msgs/msg/Float32`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Float32 {
    pub(super) data: f32,
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

/// `geometry_msgs/msg/PoseStamped`, up to its position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PoseStamped {
    pub(super) header: Header,
    pub(super) position: Vector3,
}

/// `geometry_msgs/msg/PoseWithCovarianceStamped`, up to its position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PoseWithCovarianceStamped {
    pub(super) header: Header,
    pub(super) position: Vector3,
}

/// `nav_msgs/msg/Odometry`, up to the position of its pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Odometry {
    pub(super) header: Header,
    pub(super) child_frame_id: String,
    pub(super) position: Vector3,
}

/// `sensor_msgs/msg/CompressedImage`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct CompressedImage {
    pub(super) header: Header,
    pub(super) format: String,
    #[serde(with = "serde_bytes")]
    pub(super) data: Vec<u8>,
}

/// `sensor_msgs/msg/Image`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Image {
    pub(super) header: Header,
    /// Rows, from the top.
    pub(super) height: u32,
    /// Pixels of a row.
    pub(super) width: u32,
    /// What a pixel is: `sensor_msgs/image_encodings.hpp`.
    pub(super) encoding: String,
    pub(super) is_bigendian: u8,
    /// Bytes from one row to the next.
    pub(super) step: u32,
    #[serde(with = "serde_bytes")]
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
