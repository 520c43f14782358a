//! Messages of ROS 2 (`std_msgs`, `sensor_msgs`, `geometry_msgs`, `tf2_msgs`), as CDR in little endian.

use byteorder::LittleEndian;
use serde::Serialize;

/// What stands before a message in CDR: plain, little endian, no options.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];
/// Nanoseconds in a second.
const NANOS: f64 = 1e9;

/// A message with its type's name and definition.
pub(super) trait Message: Serialize + Sized {
    /// As in `sensor_msgs/msg/Image`.
    const TYPE: &'static str;
    /// The definition, followed by those it needs (`ros2msg`).
    const DEFINITION: &'static str;

    /// Its bytes.
    fn to_cdr(&self) -> Result<Vec<u8>, String> {
        let mut bytes = ENCAPSULATION.to_vec();
        // Alignment counts from behind what stands before.
        let written = cdr_encoding::to_writer::<_, LittleEndian, _>(&mut bytes, self);
        written.map_err(|error| error.to_string()).map(|()| bytes)
    }
}

/// `builtin_interfaces/Time`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Time {
    sec: i32,
    nanosec: u32,
}

impl Time {
    /// Whether a time, s, has a form in ROS and in MCAP.
    pub(super) fn holds(time_s: f64) -> bool {
        (0.0..f64::from(i32::MAX)).contains(&time_s)
    }

    /// Of a time, s, that it holds.
    pub(super) fn new(time_s: f64) -> Self {
        let nanos = nanoseconds(time_s);
        Self {
            sec: (nanos / NANOS as u64) as i32,
            nanosec: (nanos % NANOS as u64) as u32,
        }
    }
}

/// A time, s, in ns.
pub(super) fn nanoseconds(time_s: f64) -> u64 {
    // The fraction by itself: all of a time since 1970 has fewer digits.
    let whole = time_s.floor();
    whole as u64 * NANOS as u64 + ((time_s - whole) * NANOS).round() as u64
}

/// `std_msgs/Header`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Header {
    pub(super) stamp: Time,
    pub(super) frame_id: String,
}

/// `sensor_msgs/CompressedImage`.
#[derive(Debug, Serialize)]
pub(super) struct CompressedImage {
    pub(super) header: Header,
    pub(super) format: String,
    pub(super) data: Vec<u8>,
}

/// `sensor_msgs/Image`.
#[derive(Debug, Serialize)]
pub(super) struct Image {
    pub(super) header: Header,
    pub(super) height: u32,
    pub(super) width: u32,
    pub(super) encoding: String,
    pub(super) is_bigendian: u8,
    pub(super) step: u32,
    pub(super) data: Vec<u8>,
}

/// `sensor_msgs/CameraInfo`.
#[derive(Debug, Serialize)]
pub(super) struct CameraInfo {
    pub(super) header: Header,
    pub(super) height: u32,
    pub(super) width: u32,
    pub(super) distortion_model: String,
    pub(super) d: Vec<f64>,
    pub(super) k: [f64; 9],
    pub(super) r: [f64; 9],
    pub(super) p: [f64; 12],
    pub(super) binning_x: u32,
    pub(super) binning_y: u32,
    pub(super) roi: RegionOfInterest,
}

/// `sensor_msgs/RegionOfInterest`; all zero is the whole picture.
#[derive(Debug, Default, Serialize)]
pub(super) struct RegionOfInterest {
    x_offset: u32,
    y_offset: u32,
    height: u32,
    width: u32,
    do_rectify: bool,
}

/// `geometry_msgs/Transform` or, with the same bytes, `geometry_msgs/Pose`.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Pose {
    pub(super) position: [f64; 3],
    /// x, y, z, w.
    pub(super) orientation: [f64; 4],
}

/// `geometry_msgs/PoseStamped`.
#[derive(Debug, Serialize)]
pub(super) struct PoseStamped {
    pub(super) header: Header,
    pub(super) pose: Pose,
}

/// `geometry_msgs/TransformStamped`.
#[derive(Debug, Serialize)]
pub(super) struct TransformStamped {
    pub(super) header: Header,
    pub(super) child_frame_id: String,
    pub(super) transform: Pose,
}

/// `tf2_msgs/TFMessage`.
#[derive(Debug, Serialize)]
pub(super) struct Transforms {
    pub(super) transforms: Vec<TransformStamped>,
}

/// A definition and those of `std_msgs/Header` and of what else it needs.
macro_rules! with_header {
    ($own:expr $(, $other:expr)*) => {
        concat!(
            $own,
            "================================================================================\nMSG: std_msgs/Header\n\
             builtin_interfaces/Time stamp\nstring frame_id\n\
             ================================================================================\nMSG: builtin_interfaces/Time\n\
             int32 sec\nuint32 nanosec\n"
            $(, "================================================================================\nMSG: ", $other)*
        )
    };
}

impl Message for CompressedImage {
    const TYPE: &'static str = "sensor_msgs/msg/CompressedImage";
    const DEFINITION: &'static str =
        with_header!("std_msgs/Header header\nstring format\nuint8[] data\n");
}

impl Message for Image {
    const TYPE: &'static str = "sensor_msgs/msg/Image";
    const DEFINITION: &'static str = with_header!(
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n"
    );
}

impl Message for CameraInfo {
    const TYPE: &'static str = "sensor_msgs/msg/CameraInfo";
    const DEFINITION: &'static str = with_header!(
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\n\
         float64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n",
        "sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"
    );
}

impl Message for PoseStamped {
    const TYPE: &'static str = "geometry_msgs/msg/PoseStamped";
    const DEFINITION: &'static str = with_header!(
        "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
        "geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
        "geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n",
        "geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
    );
}

impl Message for Transforms {
    const TYPE: &'static str = "tf2_msgs/msg/TFMessage";
    const DEFINITION: &'static str = with_header!(
        "geometry_msgs/TransformStamped[] transforms\n",
        "geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
        "geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
        "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n",
        "geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_has_the_bytes_of_the_standard() {
        let message = PoseStamped {
            header: Header {
                stamp: Time::new(1.25),
                frame_id: "world".to_owned(),
            },
            pose: Pose {
                position: [1.0, 2.0, 3.0],
                orientation: [0.0, 0.0, 0.0, 1.0],
            },
        };
        let bytes = message.to_cdr().expect("bytes");
        let mut expected = vec![0, 1, 0, 0];
        expected.extend(1_i32.to_le_bytes());
        expected.extend(250_000_000_u32.to_le_bytes());
        // Length with the zero at the end, and room up to a multiple of 8 from behind the first four bytes.
        expected.extend(6_u32.to_le_bytes());
        expected.extend(b"world\0");
        expected.extend([0; 6]);
        for number in [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0_f64] {
            expected.extend(number.to_le_bytes());
        }
        assert_eq!(bytes, expected);
    }

    #[test]
    fn times_keep_their_nanoseconds() {
        assert_eq!(nanoseconds(1_700_000_000.25), 1_700_000_000_250_000_000);
        assert_eq!(nanoseconds(0.1), 100_000_000);
        // What rounds to a whole second is one.
        assert_eq!(Time::new(0.999_999_999_9), Time { sec: 1, nanosec: 0 });
        assert!(Time::holds(0.0) && !Time::holds(-0.1) && !Time::holds(f64::NAN));
    }
}
