//! A sequence as other programs read it: COLMAP's text model, nerfstudio's `transforms.json`, and what [`mcap`] writes.
//!
//! The first two count image points from the top left corner of the picture, as this program does. A port's refraction is in none of their
//! models.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use glam::{DMat3, DQuat};
use serde_json::{Value, json};
use uw_render::scene::{Camera, Lens};

use super::frame::Eye;
use super::lists::lens;
use super::placing::looking_from;
use super::{Sequence, SequenceError, mcap};
use crate::dataset::name_in;
use uw_render::image::write_bytes;

/// A way to write a sequence for other programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Export {
    /// `colmap/cameras.txt`, `images.txt`, `points3D.txt`; pictures are named from the sequence's folder on.
    Colmap,
    /// `transforms.json`.
    Nerfstudio,
    /// `sequence.mcap`, messages of ROS 2.
    Mcap,
}

impl Export {
    /// Refuses a camera and times that the format has no form for.
    pub(super) fn check(self, sequence: &Sequence<'_>) -> Result<(), SequenceError> {
        if self == Self::Mcap {
            mcap::check(sequence)?;
        }
        let camera = &sequence.scene.camera;
        if self == Self::Nerfstudio && camera.lens.is_rational() {
            return Err(SequenceError::Unsuitable(
                "--format nerfstudio: it has no model for a lens with k4, k5 and k6; take --format colmap, which has".to_owned(),
            ));
        }
        if camera.port.is_none() {
            return Ok(());
        }
        Err(SequenceError::Unsuitable(format!(
            "--format {}: it has no model for a port, whose refraction depends on the distance; leave the port out of the scene, or take \
             --format tum, whose camera.json describes it",
            self.name()
        )))
    }

    /// As it is called on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Colmap => "colmap",
            Self::Nerfstudio => "nerfstudio",
            Self::Mcap => "mcap",
        }
    }

    pub(super) fn write(
        self,
        sequence: &Sequence<'_>,
        folder: &Path,
        eyes: &[Eye],
    ) -> Result<(), SequenceError> {
        match self {
            Self::Colmap => write_colmap(sequence, folder, eyes),
            Self::Mcap => mcap::write(sequence, folder, eyes),
            Self::Nerfstudio => {
                let text = format!("{:#}\n", transforms(sequence, folder, eyes));
                Ok(write_bytes(
                    &folder.join("transforms.json"),
                    text.as_bytes(),
                )?)
            }
        }
    }
}

/// Every picture with its camera, in the order of time.
fn pictures<'a>(
    sequence: &'a Sequence<'_>,
    eyes: &'a [Eye],
) -> impl Iterator<Item = (usize, Eye, Camera)> + 'a {
    let poses = sequence.trajectory.poses().iter().enumerate();
    poses.flat_map(move |(k, pose)| {
        let at = move |&eye| (k, eye, looking_from(&sequence.scene.camera, pose, eye));
        eyes.iter().map(at)
    })
}

fn write_colmap(sequence: &Sequence<'_>, folder: &Path, eyes: &[Eye]) -> Result<(), SequenceError> {
    let model = folder.join("colmap");
    fs::create_dir_all(&model).map_err(|e| SequenceError::system(&model, e))?;
    let cameras = format!(
        "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n1 {}\n",
        colmap_camera(&sequence.scene.camera)
    );
    let mut images = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of POINTS2D[], which is empty\n".to_owned();
    for (number, (k, eye, camera)) in pictures(sequence, eyes).enumerate() {
        // From the world to the camera.
        let to_camera = DMat3::from_cols(camera.right, camera.down, camera.forward).transpose();
        let q = DQuat::from_mat3(&to_camera);
        let t = -(to_camera * camera.position_m);
        let name = name_in(folder, &eye.picture(folder, k));
        let _ = writeln!(
            images,
            "{} {:.12} {:.12} {:.12} {:.12} {:.9} {:.9} {:.9} 1 {name}\n",
            number + 1,
            q.w,
            q.x,
            q.y,
            q.z,
            t.x,
            t.y,
            t.z
        );
    }
    write_bytes(&model.join("cameras.txt"), cameras.as_bytes())?;
    write_bytes(&model.join("images.txt"), images.as_bytes())?;
    let points = b"# POINT3D_ID X Y Z R G B ERROR TRACK[]\n";
    Ok(write_bytes(&model.join("points3D.txt"), points)?)
}

/// Model, size and parameters of a camera as COLMAP writes them.
fn colmap_camera(camera: &Camera) -> String {
    let [fx, fy] = camera.focal_px.to_array();
    let [cx, cy] = camera.centre_px.to_array();
    let (model, more) = match camera.lens {
        ideal if ideal.is_ideal() => ("PINHOLE", Vec::new()),
        Lens::Perspective(coefficients) => ("FULL_OPENCV", coefficients.to_vec()),
        Lens::Fisheye(coefficients) => ("OPENCV_FISHEYE", coefficients.to_vec()),
    };
    let parameters: Vec<String> = [fx, fy, cx, cy]
        .iter()
        .chain(&more)
        .map(f64::to_string)
        .collect();
    format!(
        "{model} {} {} {}",
        camera.width,
        camera.height,
        parameters.join(" ")
    )
}

fn transforms(sequence: &Sequence<'_>, folder: &Path, eyes: &[Eye]) -> Value {
    let camera = &sequence.scene.camera;
    let (model, coefficients) = lens(camera);
    let coefficient = |place: usize| coefficients.get(place).copied().unwrap_or_default();
    let mut object = json!({
        "camera_model": if model == "fisheye" { "OPENCV_FISHEYE" } else { "OPENCV" },
        "w": camera.width, "h": camera.height,
        "fl_x": camera.focal_px.x, "fl_y": camera.focal_px.y,
        "cx": camera.centre_px.x, "cy": camera.centre_px.y,
        "depth_unit_scale_factor": 0.001,
    });
    // OpenCV has the tangential terms between the second and the third radial one.
    let named: &[(&str, usize)] = match camera.lens {
        Lens::Perspective(_) => &[("k1", 0), ("k2", 1), ("p1", 2), ("p2", 3), ("k3", 4)],
        Lens::Fisheye(_) => &[("k1", 0), ("k2", 1), ("k3", 2), ("k4", 3)],
    };
    for (name, place) in named {
        object[*name] = coefficient(*place).into();
    }
    object["frames"] = pictures(sequence, eyes)
        .map(|(k, eye, camera)| {
            // Cameras look along -z there, +y is up.
            let [x, y, z] = [camera.right, -camera.down, -camera.forward];
            let p = camera.position_m;
            json!({
                "file_path": name_in(folder, &eye.picture(folder, k)),
                "depth_file_path": name_in(folder, &eye.depth(folder, k)),
                "transform_matrix": [
                    [x.x, y.x, z.x, p.x],
                    [x.y, y.y, z.y, p.y],
                    [x.z, y.z, z.z, p.z],
                    [0.0, 0.0, 0.0, 1.0],
                ],
            })
        })
        .collect();
    object
}
