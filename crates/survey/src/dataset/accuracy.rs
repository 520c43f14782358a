//! How well the images of a dataset must be known.

use serde::{Deserialize, Serialize};

/// How well mean and contrast of an image must be known before its render stops: standard errors, 8-bit counts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Accuracy {
    /// Allowed standard error of contrast and mean, counts.
    pub error_counts: f64,
    /// Allowed besides, as a share of the value.
    pub error_share: f64,
    /// Fewest paths of a render.
    pub least_paths: u32,
    /// Most paths of a render.
    pub most_paths: u32,
    /// Distance of the pixels at which an image's statistics are taken, along both axes.
    pub pixel_step: usize,
}

impl Default for Accuracy {
    fn default() -> Self {
        Self {
            error_counts: 0.05,
            error_share: 0.005,
            least_paths: 4096,
            most_paths: 65_536,
            pixel_step: 2,
        }
    }
}

impl Accuracy {
    pub(super) fn check(&self) -> Result<(), String> {
        for (field, value) in [
            ("error_counts", self.error_counts),
            ("error_share", self.error_share),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(format!(
                    "accuracy.{field} must be finite and >= 0, got {value}"
                ));
            }
        }
        if self.least_paths < 256 || self.most_paths < self.least_paths {
            return Err(format!(
                "accuracy.least_paths must be at least 256 and at most most_paths, got {} and {}",
                self.least_paths, self.most_paths
            ));
        }
        if !(1..=16).contains(&self.pixel_step) {
            return Err(format!(
                "accuracy.pixel_step must be 1 to 16, got {}",
                self.pixel_step
            ));
        }
        Ok(())
    }
}
