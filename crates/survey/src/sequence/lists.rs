//! Lists in the way of the TUM RGB-D data sets, and the camera.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use uw_render::scene::{Camera, Lens, Port, PortShape};

use super::frame::Eye;
use super::{Sequence, SequenceError};
use crate::dataset::name_in;
use uw_render::image::write_bytes;

/// Writes `groundtruth.txt`, `rgb.txt`, `depth.txt` (of the right eye with `_right`) and `camera.json`.
pub(super) fn write(
    sequence: &Sequence<'_>,
    folder: &Path,
    eyes: &[Eye],
) -> Result<(), SequenceError> {
    let poses = sequence.trajectory.poses();
    let mut truth = "# poses of the camera, of the left one of two: its right, down and forward axes as x, y, z\n\
                     # time_s tx ty tz qx qy qz qw\n"
        .to_owned();
    for pose in poses {
        let numbers = [
            pose.position_m.to_array().as_slice(),
            &pose.rotation.to_array(),
        ]
        .concat();
        let numbers: Vec<String> = numbers.iter().map(|x| format!("{x:.9}")).collect();
        let _ = writeln!(truth, "{:.9} {}", pose.time_s, numbers.join(" "));
    }
    write_bytes(&folder.join("groundtruth.txt"), truth.as_bytes())?;
    for &eye in eyes {
        let suffix = if eye == Eye::Left { "" } else { "_right" };
        let list = |file: &dyn Fn(usize) -> PathBuf| {
            let mut list = "# time_s file\n".to_owned();
            for (k, pose) in poses.iter().enumerate() {
                let name = name_in(folder, &file(k));
                let _ = writeln!(list, "{:.9} {name}", pose.time_s);
            }
            list
        };
        let rgb = list(&|k| eye.picture(folder, k));
        let depth = list(&|k| eye.depth(folder, k));
        write_bytes(&folder.join(format!("rgb{suffix}.txt")), rgb.as_bytes())?;
        write_bytes(&folder.join(format!("depth{suffix}.txt")), depth.as_bytes())?;
    }
    let camera = describe(&sequence.scene.camera, sequence.config.stereo_baseline_m);
    let text = format!("{camera:#}\n");
    Ok(write_bytes(&folder.join("camera.json"), text.as_bytes())?)
}

/// Name of the lens's model and its coefficients.
pub(super) fn lens(camera: &Camera) -> (&'static str, Vec<f64>) {
    match camera.lens {
        ideal if ideal.is_ideal() => ("pinhole", Vec::new()),
        Lens::Perspective(_) => ("brown-conrady", camera.lens.coefficients().to_vec()),
        Lens::Fisheye(_) => ("fisheye", camera.lens.coefficients().to_vec()),
    }
}

/// A camera for those who use its pictures.
fn describe(camera: &Camera, stereo_baseline_m: Option<f64>) -> Value {
    let (model, coefficients) = lens(camera);
    let [fx, fy] = camera.focal_px.to_array();
    let [cx, cy] = camera.centre_px.to_array();
    json!({
        "format": "uw-camera/1",
        "width": camera.width,
        "height": camera.height,
        "fx": fx, "fy": fy, "cx": cx, "cy": cy,
        "model": model,
        "distortion": coefficients,
        "port": camera.port.as_ref().map(port),
        "opencv": {
            "camera_matrix": [[fx, 0.0, cx - 0.5], [0.0, fy, cy - 0.5], [0.0, 0.0, 1.0]],
            "distortion": coefficients,
        },
        "depth": { "unit_m": 0.001, "none": 0, "along": "the optical axis" },
        "stereo_baseline_m": stereo_baseline_m,
    })
}

fn port(port: &Port) -> Value {
    let mut shape = match port.shape {
        PortShape::Flat { distance_m } => json!({ "kind": "flat", "distance_m": distance_m }),
        PortShape::Dome { radius_m, offset_m } => json!({
            "kind": "dome", "radius_m": radius_m, "offset_m": offset_m.to_array(),
        }),
    };
    shape["thickness_m"] = port.thickness_m.into();
    shape["glass_index"] = port.glass_index.into();
    shape["outside_index"] = port.outside_index.into();
    shape
}
