//! Motion of the camera, and of the lamps with it.

use glam::DVec3;

use super::Viewer;
use crate::model::{CameraSettings, camera::Motion};

impl Viewer {
    /// Moves the camera by `change`, and the lamps with it where they follow.
    pub(crate) fn move_camera(&mut self, change: impl FnOnce(&mut CameraSettings)) {
        let before = self.settings.camera.build();
        change(&mut self.settings.camera);
        if !(self.lamps_follow || self.motion == Motion::Vehicle) {
            return;
        }
        let after = self.settings.camera.build();
        let carried = |v: DVec3| {
            let (x, y, z) = (
                v.dot(before.right),
                v.dot(before.down),
                v.dot(before.forward),
            );
            x * after.right + y * after.down + z * after.forward
        };
        for lamp in self.settings.lamps.iter_mut().filter(|l| !l.of_gltf) {
            lamp.position_m = after.position_m + carried(lamp.position_m - before.position_m);
            lamp.forward = carried(lamp.forward).normalize_or(after.forward);
        }
    }

    /// Distance from the camera to what is in the middle of the picture, m; 2 where there is nothing.
    pub(crate) fn distance_ahead_m(&self) -> f64 {
        self.hit_ahead_m().unwrap_or(2.0)
    }

    /// Distance from the camera to what is in the middle of the picture, m.
    pub(crate) fn hit_ahead_m(&self) -> Option<f64> {
        let camera = &self.settings.camera;
        let hit = self.open.geometry.closest(
            camera.position_m,
            camera.forward,
            f64::INFINITY,
            uw_render::prepare::Primitive::None,
        );
        hit.map(|hit| hit.t)
    }

    /// Sets the camera so that what is ahead lies at `distance_m`, and all lamps to `light_pct`.
    pub(crate) fn go_to(&mut self, depth_m: Option<f64>, distance_m: f64, light_pct: f64) {
        let ahead = self.distance_ahead_m();
        let height = self.settings.surface.map(|s| s.height_m);
        self.move_camera(|camera| {
            camera.position_m += (ahead - distance_m) * camera.forward;
            if let (Some(height), Some(depth)) = (height, depth_m) {
                camera.position_m.z = height - depth;
            }
        });
        for lamp in &mut self.settings.lamps {
            lamp.level_pct = light_pct.clamp(0.0, 100.0);
        }
    }
}
