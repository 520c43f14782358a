//! ROS 2 itself, without a ROS installation: range, depth, lamp level and pictures come as messages, suggestions go out as ones.
//!
//! A node among others over DDS, the transport that ROS 2 has by default (crate `ros2-client` on RustDDS). Its message type is
//! `uwguide_msgs/msg/Suggestion` (`ros2/uwguide_msgs`). It is compiled with the feature `ros2` alone.

#[cfg(feature = "ros2")]
mod answering;
#[cfg(feature = "ros2")]
mod colours;
#[cfg(feature = "ros2")]
mod messages;
#[cfg(feature = "ros2")]
mod node;
#[cfg(feature = "ros2")]
mod picture;
#[cfg(feature = "ros2")]
mod requests;
#[cfg(feature = "ros2")]
mod suggestion;
#[cfg(feature = "ros2")]
mod topics;
#[cfg(feature = "ros2")]
mod types;

#[cfg(feature = "ros2")]
pub use node::Link;

/// Largest DDS domain whose ports there are.
pub const MOST_DOMAIN: u16 = 232;

/// What a number comes as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberType {
    /// `std_msgs/msg/Float64`.
    Float64,
    /// `std_msgs/msg/Float32`.
    Float32,
}

/// What the distance of the target comes as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RangeType {
    /// `sensor_msgs/msg/Range`.
    Echo,
    /// Metres.
    Metres(NumberType),
}

/// What depth comes as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthType {
    /// Metres below the surface.
    Metres(NumberType),
    /// `sensor_msgs/msg/FluidPressure`: absolute pressure, Pa.
    Pressure,
    /// `geometry_msgs/msg/PoseStamped`: z is 0 at the surface, m.
    Pose,
    /// `geometry_msgs/msg/PoseWithCovarianceStamped`: the same.
    PoseWithCovariance,
    /// `nav_msgs/msg/Odometry`: the same.
    Odometry,
}

/// Which way a depth or a z grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthAxis {
    /// Upwards, as z does in the world's frames (REP 103).
    Up,
    /// Downwards, as depths do.
    Down,
}

/// What pictures come as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageType {
    /// `sensor_msgs/msg/CompressedImage`: PNG or JPEG.
    Compressed,
    /// `sensor_msgs/msg/Image`: pixels.
    Raw,
}

impl ImageType {
    /// The topic that `image_transport` gives to pictures of this type.
    pub fn usual_topic(self) -> &'static str {
        match self {
            Self::Compressed => "/camera/image_raw/compressed",
            Self::Raw => "/camera/image_raw",
        }
    }
}

/// Which way the camera looks in its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraAxis {
    /// Along x, as bodies do (REP 103).
    X,
    /// Along z, as frames with the suffix `_optical` do (REP 103).
    Z,
}

/// Topics and what their numbers mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Ros2Config {
    /// Whether the node runs.
    pub enabled: bool,
    /// The DDS domain; `None` takes that of the variable `ROS_DOMAIN_ID`, else 0.
    pub domain_id: Option<u16>,
    /// Topic of the distance.
    pub range_topic: String,
    /// Its type.
    pub range_type: RangeType,
    /// Topic of the depth.
    pub depth_topic: String,
    /// Its type.
    pub depth_type: DepthType,
    /// Which way it grows; `None`: down for numbers, up for poses.
    pub depth_axis: Option<DepthAxis>,
    /// Topic of the light of the lamps, percent of full.
    pub light_topic: String,
    /// Its type.
    pub light_type: NumberType,
    /// Topic of the pictures.
    pub image_topic: String,
    /// Its type.
    pub image_type: ImageType,
    /// Topic of the suggestions.
    pub suggestion_topic: String,
    /// What is added to a range for the distance of the camera, m.
    pub range_offset_m: f64,
    /// Pressure at the surface, Pa.
    pub surface_pressure_pa: f64,
    /// Density of the water, kg/m³.
    pub water_density_kg_per_m3: f64,
    /// Which way the camera looks in its frame.
    pub camera_axis: CameraAxis,
    /// Whether the stamps of headers are times of this machine's clock; else messages are as old as their arrival.
    pub stamps: bool,
    /// Whether publishers have to repeat what is lost.
    pub reliable: bool,
    /// After so long without a picture suggestions are made without one, s,
    pub silence_s: f64,
    /// so often, Hz.
    pub rate_hz: f64,
}

impl Default for Ros2Config {
    fn default() -> Self {
        Self {
            enabled: false,
            domain_id: None,
            range_topic: "/range".to_owned(),
            range_type: RangeType::Echo,
            depth_topic: "/depth".to_owned(),
            depth_type: DepthType::Metres(NumberType::Float64),
            depth_axis: None,
            light_topic: "/light_pct".to_owned(),
            light_type: NumberType::Float64,
            image_topic: ImageType::Compressed.usual_topic().to_owned(),
            image_type: ImageType::Compressed,
            suggestion_topic: "/uwguide/suggestion".to_owned(),
            range_offset_m: 0.0,
            surface_pressure_pa: 101_325.0,
            water_density_kg_per_m3: 1025.0,
            camera_axis: CameraAxis::Z,
            stamps: true,
            reliable: false,
            silence_s: 3.0,
            rate_hz: 2.0,
        }
    }
}

/// The node of a program without ROS 2, of which there is none.
#[cfg(not(feature = "ros2"))]
#[derive(Debug)]
pub struct Link(std::convert::Infallible);

#[cfg(not(feature = "ros2"))]
impl Link {
    /// # Errors
    /// Always.
    pub fn open(_: &Ros2Config) -> Result<Self, String> {
        Err("this uwguide was built without ROS 2; with it: cargo build --release -p uw-daemon --features ros2".to_owned())
    }

    /// Never called.
    pub async fn run(self, _: super::Feeder) {
        match self.0 {}
    }
}
