//! A sequence as one file of ROS 2 messages (MCAP, profile `ros2`): pictures, depth, camera, pose and frames of reference.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use image::ImageReader;
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use uw_render::image::{ImageError, write_atomically};
use uw_render::scene::{Camera, Lens};

use super::frame::Eye;
use super::ros::{
    CameraInfo, CompressedImage, Header, Image, Message, Pose, PoseStamped, RegionOfInterest, Time,
    TransformStamped, Transforms, nanoseconds,
};
use super::{Sequence, SequenceError};

/// Its name in the folder.
const FILE: &str = "sequence.mcap";
/// The frame of the poses.
const WORLD: &str = "world";
/// Bytes of messages after which a chunk ends.
const CHUNK_BYTES: u64 = 4 << 20;

/// Refuses times that ROS has no form for.
pub(super) fn check(sequence: &Sequence<'_>) -> Result<(), SequenceError> {
    let mut times = sequence.trajectory.poses().iter().map(|pose| pose.time_s);
    match times.find(|&time_s| !Time::holds(time_s)) {
        None => Ok(()),
        Some(time_s) => Err(SequenceError::Unsuitable(format!(
            "--format mcap: times must be from 0 to {} s, got {time_s}",
            i32::MAX
        ))),
    }
}

/// Writes `sequence.mcap`.
pub(super) fn write(
    sequence: &Sequence<'_>,
    folder: &Path,
    eyes: &[Eye],
) -> Result<(), SequenceError> {
    let path = folder.join(FILE);
    let failed = |reason: String| ImageError::Content {
        path: path.clone(),
        reason,
    };
    let written = write_atomically(&path, |file| {
        let mut recording = Recording::new(file).map_err(|e| failed(e.to_string()))?;
        for (k, pose) in sequence.trajectory.poses().iter().enumerate() {
            recording
                .frame(sequence, folder, eyes, (k, pose.time_s))
                .map_err(failed)?;
        }
        recording.end().map_err(|e| failed(e.to_string()))
    });
    Ok(written?)
}

struct Recording<W: std::io::Write + std::io::Seek> {
    writer: Writer<W>,
    channels: BTreeMap<String, u16>,
}

impl<W: std::io::Write + std::io::Seek> Recording<W> {
    fn new(file: W) -> Result<Self, McapError> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("uw/", env!("CARGO_PKG_VERSION")))
            // Pictures are compressed already.
            .compression(None)
            .chunk_size(Some(CHUNK_BYTES));
        Ok(Self {
            writer: options.create(file)?,
            channels: BTreeMap::new(),
        })
    }

    fn end(mut self) -> Result<(), McapError> {
        self.writer.finish().map(|_| ())
    }

    /// All that belongs to a frame.
    fn frame(
        &mut self,
        sequence: &Sequence<'_>,
        folder: &Path,
        eyes: &[Eye],
        (k, time_s): (usize, f64),
    ) -> Result<(), String> {
        let own = &sequence.trajectory.poses()[k];
        let pose = Pose {
            position: own.position_m.to_array(),
            orientation: own.rotation.to_array(),
        };
        let header = |frame: &str| Header {
            stamp: Time::new(time_s),
            frame_id: frame.to_owned(),
        };
        let at = (k, time_s);
        let stamped = PoseStamped {
            header: header(WORLD),
            pose,
        };
        self.message("/pose", at, &stamped)?;
        let transforms = eyes.iter().map(|eye| match eye {
            Eye::Left => TransformStamped {
                header: header(WORLD),
                child_frame_id: frame_of(*eye),
                transform: pose,
            },
            Eye::Right(baseline_m) => TransformStamped {
                header: header(&frame_of(Eye::Left)),
                child_frame_id: frame_of(*eye),
                transform: Pose {
                    position: [*baseline_m, 0.0, 0.0],
                    orientation: [0.0, 0.0, 0.0, 1.0],
                },
            },
        });
        let transforms = Transforms {
            transforms: transforms.collect(),
        };
        self.message("/tf", at, &transforms)?;
        for eye in eyes {
            let side = side_of(*eye);
            let header = header(&frame_of(*eye));
            let camera = camera_info(&sequence.scene.camera, *eye, header.clone());
            self.message(&format!("/{side}/camera_info"), at, &camera)?;
            let picture = CompressedImage {
                header: header.clone(),
                format: "png".to_owned(),
                data: read(&eye.picture(folder, k))?,
            };
            self.message(&format!("/{side}/image/compressed"), at, &picture)?;
            let depth = depth_image(&eye.depth(folder, k), header)?;
            self.message(&format!("/{side}/depth"), at, &depth)?;
        }
        Ok(())
    }

    fn message<M: Message>(
        &mut self,
        topic: &str,
        (k, time_s): (usize, f64),
        message: &M,
    ) -> Result<(), String> {
        let told = |error: McapError| error.to_string();
        let channel_id = match self.channels.get(topic) {
            Some(&channel) => channel,
            None => {
                let definition = M::DEFINITION.as_bytes();
                let schema = self.writer.add_schema(M::TYPE, "ros2msg", definition);
                let schema = schema.map_err(told)?;
                let channel = self
                    .writer
                    .add_channel(schema, topic, "cdr", &BTreeMap::new());
                let channel = channel.map_err(told)?;
                self.channels.insert(topic.to_owned(), channel);
                channel
            }
        };
        let time = nanoseconds(time_s);
        let header = MessageHeader {
            channel_id,
            sequence: k as u32,
            log_time: time,
            publish_time: time,
        };
        let bytes = message.to_cdr()?;
        self.writer
            .write_to_known_channel(&header, &bytes)
            .map_err(told)
    }
}

fn side_of(eye: Eye) -> &'static str {
    match eye {
        Eye::Left => "left",
        Eye::Right(_) => "right",
    }
}

/// The frame of an eye: x to the right, y down, z ahead (REP 103, optical).
fn frame_of(eye: Eye) -> String {
    format!("{}_optical", side_of(eye))
}

fn read(path: &Path) -> Result<Vec<u8>, String> {
    fs::read(path).map_err(|error| format!("{}: {error}", path.display()))
}

/// A depth picture, in mm.
fn depth_image(path: &Path, header: Header) -> Result<Image, String> {
    let told = |error: String| format!("{}: {error}", path.display());
    let reader = ImageReader::open(path).map_err(|e| told(e.to_string()))?;
    let depth = reader
        .decode()
        .map_err(|e| told(e.to_string()))?
        .into_luma16();
    let (width, height) = depth.dimensions();
    Ok(Image {
        header,
        height,
        width,
        encoding: "16UC1".to_owned(),
        is_bigendian: 0,
        step: 2 * width,
        data: depth.iter().flat_map(|mm| mm.to_le_bytes()).collect(),
    })
}

/// The camera as OpenCV counts: from the middle of the first pixel.
fn camera_info(camera: &Camera, eye: Eye, header: Header) -> CameraInfo {
    let [fx, fy] = camera.focal_px.to_array();
    let [cx, cy] = camera.centre_px.to_array().map(|c| c - 0.5);
    let model = match camera.lens {
        rational if rational.is_rational() => "rational_polynomial",
        Lens::Perspective(_) => "plumb_bob",
        Lens::Fisheye(_) => "equidistant",
    };
    CameraInfo {
        header,
        height: camera.height,
        width: camera.width,
        distortion_model: model.to_owned(),
        d: camera.lens.coefficients().to_vec(),
        k: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [
            fx,
            0.0,
            cx,
            -fx * eye.offset_m(),
            0.0,
            fy,
            cy,
            0.0,
            0.0,
            0.0,
            1.0,
            0.0,
        ],
        binning_x: 0,
        binning_y: 0,
        roi: RegionOfInterest::default(),
    }
}
