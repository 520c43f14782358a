//! The camera and how a person moves it.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use uw_render::scene::{Camera, Lens, Opening, Port};

use super::settings::rounded;

/// The camera of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraSettings {
    /// Centre of projection, m.
    pub position_m: DVec3,
    /// Unit direction of view.
    pub forward: DVec3,
    /// Unit direction of the image's upward edge.
    pub up: DVec3,
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// Focal lengths, pixels.
    pub focal_px: DVec2,
    /// Principal point, pixels.
    pub centre_px: DVec2,
    /// What the lens makes of directions.
    pub lens: Lens,
    /// Diameter of the lens's opening, m; 0 for a pinhole.
    pub aperture_m: f64,
    /// Distance along the optical axis that is in focus, m.
    pub focus_m: f64,
    /// The port it looks through, as if into air: what is outside is the scene's to say.
    pub port: Option<Port>,
}

/// How drags and keys move the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Motion {
    /// Around a point in front of the camera.
    #[default]
    Orbit,
    /// Freely: drags turn, keys move along the view.
    Fly,
    /// As a vehicle that stays level: drags turn its heading and tilt its camera, keys move it level and in depth,
    /// its lamps with it.
    Vehicle,
}

impl Motion {
    /// All, with their names.
    pub const ALL: [(Self, &'static str); 3] = [
        (Self::Orbit, "Orbit"),
        (Self::Fly, "Fly"),
        (Self::Vehicle, "Vehicle"),
    ];
}

/// Where the focus is of a camera that was a pinhole, m.
const FOCUS_M: f64 = 1.0;
/// Smallest angle between the view and the vertical that drags reach, degrees.
const LEAST_POLAR_DEG: f64 = 1.0;

impl From<&Camera> for CameraSettings {
    fn from(camera: &Camera) -> Self {
        Self {
            position_m: camera.position_m,
            forward: camera.forward,
            up: -camera.down,
            width: camera.width,
            height: camera.height,
            focal_px: camera.focal_px,
            centre_px: camera.centre_px,
            lens: camera.lens,
            aperture_m: camera.opening.map_or(0.0, |opening| opening.diameter_m),
            focus_m: camera.opening.map_or(FOCUS_M, |opening| opening.focus_m),
            port: camera.port.map(|port| Port {
                outside_index: 1.0,
                ..port
            }),
        }
    }
}

impl CameraSettings {
    /// The camera as the renderer takes it, its port in air.
    pub fn build(&self) -> Camera {
        let right = self.forward.cross(self.up).normalize_or(DVec3::Y);
        Camera {
            position_m: self.position_m,
            forward: self.forward,
            right,
            down: self.forward.cross(right),
            width: self.width,
            height: self.height,
            focal_px: self.focal_px,
            centre_px: self.centre_px,
            lens: self.lens,
            opening: (self.aperture_m > 0.0).then_some(Opening {
                diameter_m: self.aperture_m,
                focus_m: self.focus_m,
            }),
            port: self.port,
        }
    }

    /// The same view in `width` × `height` pixels.
    pub fn resized(&self, width: u32, height: u32) -> Self {
        let scale = DVec2::new(
            f64::from(width) / f64::from(self.width),
            f64::from(height) / f64::from(self.height),
        );
        Self {
            width,
            height,
            focal_px: self.focal_px * scale,
            centre_px: self.centre_px * scale,
            ..self.clone()
        }
    }

    /// The largest size of the picture's proportions within `limit` pixels, at most its own.
    pub fn size_within(&self, limit: DVec2) -> (u32, u32) {
        let own = DVec2::new(f64::from(self.width), f64::from(self.height));
        let scale = (limit / own).min_element().min(1.0);
        let side = |full: f64| (full * scale).round().max(1.0) as u32;
        (side(own.x), side(own.y))
    }

    /// Horizontal field of view, degrees.
    pub fn hfov_deg(&self) -> f64 {
        rounded(self.lens.hfov_deg(self.focal_px.x, self.width))
    }

    /// Sets the horizontal field of view, degrees in (0, 180), with square pixels; nothing changes where a fisheye folds before
    /// that.
    pub fn set_hfov_deg(&mut self, hfov_deg: f64) {
        let wanted = (self.lens).focal_length_px(hfov_deg.clamp(0.1, 179.0), self.width);
        self.focal_px = wanted.map_or(self.focal_px, DVec2::splat);
    }

    /// Whether it is the ideal camera that a field of view describes, but for a port.
    pub fn is_ideal(&self) -> bool {
        let middle = DVec2::new(f64::from(self.width), f64::from(self.height)) / 2.0;
        self.lens.is_ideal()
            && (self.focal_px.x - self.focal_px.y).abs() < 1e-9 * self.focal_px.x
            && (self.centre_px - middle).length() < 1e-9
    }

    /// Looks at `target` from where it is, upright where that is possible.
    pub fn look_at(&mut self, target: DVec3) {
        if let Some(forward) = (target - self.position_m).try_normalize() {
            self.forward = forward;
            self.up = upright(forward, self.up);
        }
    }

    /// Turns the view by a drag of `delta_px` over a picture `width_px` wide: what was under the pointer stays there.
    pub fn turn(&mut self, delta_px: DVec2, width_px: f64) {
        let angle = delta_px / width_px.max(1.0) * self.hfov_deg().to_radians();
        self.turn_by(angle.x, angle.y);
    }

    /// Turns to the left by `yaw` about the vertical and upwards by `pitch`, radians.
    fn turn_by(&mut self, yaw: f64, pitch: f64) {
        let heading = turned(self.forward, DVec3::Z, yaw);
        let up = turned(self.up, DVec3::Z, yaw);
        let right = heading.cross(up).normalize_or(DVec3::Y);
        let forward = turned(heading, right, pitch);
        let least = LEAST_POLAR_DEG.to_radians().sin();
        let steep = forward.cross(DVec3::Z).length() < least;
        // A view that is steep already, as of a camera that looks down, only turns about the vertical.
        let new = if steep { heading } else { forward };
        self.forward = new.normalize_or(self.forward);
        self.up = upright(self.forward, up);
    }

    /// Moves around the point `distance_m` ahead by a drag.
    pub fn orbit(&mut self, delta_px: DVec2, width_px: f64, distance_m: f64) {
        let pivot = self.position_m + distance_m * self.forward;
        let angle = delta_px / width_px.max(1.0) * std::f64::consts::PI;
        self.turn_by(-angle.x, -angle.y);
        self.position_m = pivot - distance_m * self.forward;
    }

    /// Moves sideways and up by a drag, so that a point `distance_m` ahead stays under the pointer.
    pub fn pan(&mut self, delta_px: DVec2, width_px: f64, distance_m: f64) {
        let camera = self.build();
        let per_px = distance_m * f64::from(self.width) / self.focal_px.x / width_px.max(1.0);
        self.position_m -= per_px * (delta_px.x * camera.right + delta_px.y * camera.down);
    }

    /// Moves by `step` metres: x to the right, y up, z along the view.
    pub fn step(&mut self, motion: Motion, step: DVec3) {
        let camera = self.build();
        let (ahead, right, up) = match motion {
            Motion::Vehicle => {
                let level = DVec3::new(self.forward.x, self.forward.y, 0.0);
                let tilted = DVec3::new(self.up.x, self.up.y, 0.0);
                // A camera that looks straight down has its upper edge ahead.
                let ahead = if level.length() > 0.1 { level } else { tilted };
                let ahead = ahead.normalize_or(DVec3::X);
                (ahead, ahead.cross(DVec3::Z), DVec3::Z)
            }
            Motion::Orbit | Motion::Fly => (self.forward, camera.right, -camera.down),
        };
        self.position_m += step.x * right + step.y * up + step.z * ahead;
    }
}

/// `v` turned about the unit `axis` by `angle` (Rodrigues).
fn turned(v: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = angle.sin_cos();
    v * cos + axis.cross(v) * sin + axis * axis.dot(v) * (1.0 - cos)
}

/// A unit vector across `forward`, as vertical as can be; near the vertical as close to `wish` as can be.
fn upright(forward: DVec3, wish: DVec3) -> DVec3 {
    let least = (0.9 * LEAST_POLAR_DEG).to_radians().sin();
    let of = if forward.cross(DVec3::Z).length() > least {
        DVec3::Z
    } else {
        wish
    };
    let across = of - forward * forward.dot(of);
    across.normalize_or(forward.any_orthonormal_vector())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> CameraSettings {
        CameraSettings {
            position_m: DVec3::new(1.0, 2.0, -3.0),
            forward: DVec3::X,
            up: DVec3::Z,
            width: 320,
            height: 180,
            focal_px: DVec2::splat(300.0),
            centre_px: DVec2::new(160.0, 90.0),
            lens: Lens::default(),
            aperture_m: 0.0,
            focus_m: FOCUS_M,
            port: None,
        }
    }

    #[test]
    fn a_smaller_picture_shows_the_same() {
        let full = camera().build();
        let small = camera().resized(40, 22).build();
        let edge = |c: &Camera, u: f64, v: f64| {
            c.direction(u * f64::from(c.width), v * f64::from(c.height))
        };
        for (u, v) in [(0.0, 0.0), (1.0, 0.3), (0.5, 1.0)] {
            assert!((edge(&full, u, v) - edge(&small, u, v)).length() < 1e-12);
        }
        assert_eq!(camera().size_within(DVec2::new(160.0, 500.0)), (160, 90));
        assert_eq!(camera().size_within(DVec2::new(9e9, 9e9)), (320, 180));
    }

    #[test]
    fn orbits_keep_their_distance_and_their_pivot_in_the_middle() {
        let mut c = camera();
        let pivot = c.position_m + 2.0 * c.forward;
        for delta in [DVec2::new(40.0, 10.0), DVec2::new(-130.0, 900.0)] {
            c.orbit(delta, 320.0, 2.0);
            assert!((c.position_m.distance(pivot) - 2.0).abs() < 1e-9);
            assert!((c.forward.length() - 1.0).abs() < 1e-12);
            assert!(c.forward.dot(c.up).abs() < 1e-9);
            assert!((c.position_m + 2.0 * c.forward).distance(pivot) < 1e-9);
        }
    }

    #[test]
    fn a_drag_takes_the_picture_along() {
        let mut c = camera();
        let point = c.position_m + 4.0 * c.forward;
        c.turn(DVec2::new(16.0, 0.0), 320.0);
        let x = c.build().project(point).expect("in view").x;
        assert!((x - 176.0).abs() < 1.5, "{x}");
        let mut c = camera();
        c.pan(DVec2::new(16.0, -8.0), 320.0, 4.0);
        let seen = c.build().project(point).expect("in view");
        assert!((seen - DVec2::new(176.0, 82.0)).length() < 1e-6, "{seen}");
    }

    #[test]
    fn a_vehicle_stays_level() {
        let mut c = camera();
        c.turn(DVec2::new(0.0, 60.0), 320.0);
        let z = c.position_m.z;
        c.step(Motion::Vehicle, DVec3::new(0.5, 0.0, 1.0));
        assert_eq!(c.position_m.z, z);
        c.step(Motion::Vehicle, DVec3::new(0.0, 0.25, 0.0));
        assert!((c.position_m.z - z - 0.25).abs() < 1e-12);
    }

    #[test]
    fn the_field_of_view_can_be_set() {
        let mut c = camera();
        c.set_hfov_deg(75.0);
        assert!((c.hfov_deg() - 75.0).abs() < 1e-6 && c.is_ideal());
    }
}
