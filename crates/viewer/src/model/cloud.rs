//! Clouds in the water, as the panel sets them.

use glam::DVec3;
use uw_media::Iops;
use uw_render::scene::{Camera, Plume};

use super::{CameraSettings, depth_profile::LARGEST_PER_M};

/// Most clouds, as in scene files.
pub const MOST_CLOUDS: usize = 64;
/// Smallest and largest standard deviation that is set by hand, m; the smallest is that of scene files.
pub const SIGMA_RANGE_M: (f64, f64) = (1e-3, 1e4);

/// A cloud: its coefficients times exp(-r²/2σ²) at a distance r from its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cloud {
    /// Middle, m.
    pub centre_m: DVec3,
    /// Standard deviation σ, m.
    pub sigma_m: f64,
    /// Absorption and scattering in its middle per channel, 1/m.
    pub iops: Iops,
}

impl Cloud {
    /// Largest coefficient that is set by hand, 1/m.
    pub const LARGEST_PER_M: f64 = LARGEST_PER_M;

    /// A cloud of stirred sediment half way to what is `distance_m` ahead of the camera.
    pub fn ahead(camera: &CameraSettings, distance_m: f64) -> Self {
        let distance_m = distance_m.clamp(0.2, 20.0);
        Self {
            centre_m: camera.position_m + 0.5 * distance_m * camera.forward,
            sigma_m: 0.15 * distance_m,
            iops: Iops {
                a: [0.1; 3],
                b: [1.0; 3],
            },
        }
    }

    /// Where the cloud is in the picture of a camera and how large: middle and radius of a circle at one standard deviation,
    /// pixels; `None` for one that is not in front of the camera.
    pub fn circle(&self, camera: &Camera) -> Option<(glam::DVec2, f64)> {
        let middle = camera.project(self.centre_m)?;
        let rim = camera.project(self.centre_m + self.sigma_m * camera.right)?;
        Some((middle, (rim - middle).length()))
    }
}

impl From<&Plume> for Cloud {
    fn from(plume: &Plume) -> Self {
        Self {
            centre_m: plume.centre_m,
            sigma_m: plume.sigma_m,
            iops: plume.iops,
        }
    }
}

impl From<&Cloud> for Plume {
    fn from(cloud: &Cloud) -> Self {
        Self {
            centre_m: cloud.centre_m,
            sigma_m: cloud.sigma_m,
            iops: cloud.iops,
        }
    }
}
