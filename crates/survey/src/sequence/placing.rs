//! Camera, lamps and marine snow at a pose.

use std::ops::Range;

use glam::{DMat3, DVec3};
use uw_render::scene::{Camera, Scene};

use super::frame::Eye;
use super::{Pose, Sequence, SequenceError};

/// Checks that lamps stay in the water all along, and that there is one where a level is given.
pub(super) fn check(sequence: &Sequence<'_>) -> Result<(), SequenceError> {
    let has_level = sequence.path.poses()[0].level_pct.is_some();
    let lamps = &sequence.scene.lamps;
    if has_level && lamps.iter().all(|lamp| is_fixed(sequence, &lamp.name)) {
        let text = "the trajectory has level_pct, and the scene no lamp that moves along and could be dimmed; leave the column out";
        return Err(SequenceError::Unsuitable(text.to_owned()));
    }
    let Some(surface) = sequence.scene.surface else {
        return Ok(());
    };
    for (k, pose) in sequence.path.poses().iter().enumerate() {
        let moved = Moved::to(&sequence.scene.camera, pose);
        for lamp in &sequence.scene.lamps {
            let z = moved.point(lamp.position_m).z;
            if !is_fixed(sequence, &lamp.name) && z >= surface.height_m {
                return Err(SequenceError::Unsuitable(format!(
                    "pose {k} ({} s): lamp {} would be at z = {z:.3} m, not below the water surface at {} m; lamps move with the \
                     camera, --fixed-lamp {} leaves it where it is",
                    pose.time_s, lamp.name, surface.height_m, lamp.name
                )));
            }
        }
    }
    Ok(())
}

fn is_fixed(sequence: &Sequence<'_>, lamp: &str) -> bool {
    sequence.config.fixed_lamps.iter().any(|name| name == lamp)
}

/// The scene without quads, meshes, materials and textures.
pub(super) fn without_surfaces(scene: &Scene) -> Scene {
    Scene {
        water: scene.water.clone(),
        snow: scene.snow,
        surface: scene.surface,
        sun: scene.sun,
        sky_radiance: scene.sky_radiance,
        camera: scene.camera.clone(),
        spectral: scene.spectral.clone(),
        lamps: scene.lamps.clone(),
        quads: Vec::new(),
        meshes: Vec::new(),
        materials: Vec::new(),
        textures: Vec::new(),
        sensor: scene.sensor,
        render: scene.render,
        warnings: Vec::new(),
    }
}

/// What part of a frame is seen when.
#[derive(Clone, Debug)]
pub(super) struct Moment {
    /// Where the camera is.
    pub(super) pose: Pose,
    /// Velocity along the trajectory, m/s.
    pub(super) velocity_m_s: DVec3,
    /// For how long flakes streak, s; `None`: as long as the scene says.
    pub(super) exposure_s: Option<f64>,
    /// Rows of the picture.
    pub(super) rows: Range<u32>,
}

/// `shell` as an eye sees it at a moment: lamps keep their place before the camera of the scene but for fixed ones and have the pose's level, flakes have drifted
/// since the first pose, and streak by the velocity along the trajectory.
pub(super) fn placed(shell: &Scene, sequence: &Sequence<'_>, moment: &Moment, eye: Eye) -> Scene {
    let (first, pose) = (&sequence.trajectory.poses()[0], &moment.pose);
    let moved = Moved::to(&sequence.scene.camera, pose);
    let mut scene = shell.clone();
    for lamp in &mut scene.lamps {
        if !is_fixed(sequence, &lamp.name) {
            lamp.position_m = moved.point(lamp.position_m);
            lamp.forward = (moved.turn * lamp.forward).normalize();
            lamp.level_pct = pose.level_pct.unwrap_or(lamp.level_pct);
        }
    }
    scene.camera = looking_from(&scene.camera, pose, eye);
    // The picture of some rows is that of a camera whose middle lies elsewhere.
    scene.camera.centre_px.y -= f64::from(moment.rows.start);
    scene.camera.height = moment.rows.len() as u32;
    scene.camera = scene.placed_camera();
    if let Some(snow) = &mut scene.snow {
        snow.time_s += pose.time_s - first.time_s;
        snow.blur.velocity_m_s = moment.velocity_m_s;
        snow.blur.exposure_s = moment.exposure_s.unwrap_or(snow.blur.exposure_s);
    }
    scene
}

/// A camera at a pose.
pub(super) fn looking_from(camera: &Camera, pose: &Pose, eye: Eye) -> Camera {
    let axes = DMat3::from_quat(pose.rotation);
    Camera {
        position_m: pose.position_m + eye.offset_m() * axes.x_axis,
        right: axes.x_axis,
        down: axes.y_axis,
        forward: axes.z_axis,
        ..camera.clone()
    }
}

/// What brings the scene's camera to a pose.
struct Moved {
    from: DVec3,
    turn: DMat3,
    to: DVec3,
}

impl Moved {
    fn to(camera: &Camera, pose: &Pose) -> Self {
        let own = DMat3::from_cols(camera.right, camera.down, camera.forward);
        Self {
            from: camera.position_m,
            turn: DMat3::from_quat(pose.rotation) * own.transpose(),
            to: pose.position_m,
        }
    }

    fn point(&self, point_m: DVec3) -> DVec3 {
        self.to + self.turn * (point_m - self.from)
    }
}
