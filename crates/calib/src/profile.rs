//! The calibration profile: how illumination falls with depth and contrast with distance.
//!
//! K_z(z) is the mean of an upward-looking image at depth z divided by the mean at the shallowest depth.
//! K_c(d) is the contrast of an image of the target from distance d, with the lamps on and with them off.
//! Between samples values are interpolated linearly; outside them there is no value.

use serde::Serialize;
use thiserror::Error;

use crate::json::FieldError;
use crate::rig::Rig;

mod corrected;
mod file;

pub use corrected::{Corrected, CorrectedSample};
pub use file::{PROFILE_FORMAT, PROFILE_UNIT};

/// Why a profile cannot be read, written or asked.
#[derive(Debug, Error)]
pub enum ProfileError {
    /// The file cannot be read.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// File name.
        file: String,
        /// The system's answer.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error("{file}: cannot be written: {source}")]
    Write {
        /// File name.
        file: String,
        /// The system's answer.
        source: std::io::Error,
    },
    /// The file is not JSON.
    #[error("{file}: not valid JSON: {source}")]
    Json {
        /// File name.
        file: String,
        /// What the parser found, with line and column.
        source: serde_json::Error,
    },
    /// A field of the file is wrong.
    #[error("{file}: {source}")]
    File {
        /// File name.
        file: String,
        /// The field and what is wrong with it.
        source: FieldError,
    },
    /// A field of a profile that came from elsewhere is wrong.
    #[error("profile: {0}")]
    Field(#[from] FieldError),
    /// Asked for a value outside the calibrated range.
    #[error("{what} must be between {min:?} and {max:?} m (calibrated), got {value}")]
    OutsideCalibration {
        /// `depth_m` or `distance_m`.
        what: &'static str,
        /// Value asked for, m.
        value: f64,
        /// Smallest calibrated value, m.
        min: f64,
        /// Largest calibrated value, m.
        max: f64,
    },
}

/// Illumination at one depth, relative to the shallowest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DepthSample {
    /// Depth, m, >= 0.
    pub depth_m: f64,
    /// K_z per channel, no unit, >= 0.
    pub k_z: [f64; 3],
}

/// Contrast of the target from one distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ContrastSample {
    /// Distance along the optical axis, m, > 0.
    pub distance_m: f64,
    /// K_c per channel, 8-bit counts, >= 0.
    pub k_c: [f64; 3],
}

/// Where a profile comes from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Source {
    /// Program and version.
    pub made_by: String,
    /// Number of images measured.
    pub images: u64,
    /// Anything worth knowing, such as the water or the place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// A calibration profile; always complete: samples strictly increasing, all numbers finite, and the
/// distances with lamps on and off overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    depth: Vec<DepthSample>,
    contrast_on: Vec<ContrastSample>,
    contrast_off: Vec<ContrastSample>,
    source: Source,
    rig: Rig,
    contrast_depth_m: Option<[f64; 2]>,
    corrected: Option<Corrected>,
}

impl Profile {
    /// A profile from its samples, in order of increasing depth and distance.
    pub fn new(
        depth: Vec<DepthSample>,
        contrast_on: Vec<ContrastSample>,
        contrast_off: Vec<ContrastSample>,
        source: Source,
    ) -> Result<Self, ProfileError> {
        let rows = |samples: &[ContrastSample]| -> Vec<_> {
            samples.iter().map(|s| (s.distance_m, s.k_c)).collect()
        };
        let depths: Vec<_> = depth.iter().map(|s| (s.depth_m, s.k_z)).collect();
        check_samples("depth", "depth_m", "k_z", &depths)?;
        check_samples("contrast_on", "distance_m", "k_c", &rows(&contrast_on))?;
        check_samples("contrast_off", "distance_m", "k_c", &rows(&contrast_off))?;
        let profile = Self {
            depth,
            contrast_on,
            contrast_off,
            source,
            rig: Rig::default(),
            contrast_depth_m: None,
            corrected: None,
        };
        let (min, max) = profile.distance_range_m();
        if min > max {
            return Err(FieldError::invalid(
                "contrast_off",
                "sampled over distances that overlap with those of contrast_on",
                "no common distance",
            )
            .into());
        }
        Ok(profile)
    }

    /// The same profile of pictures of this camera with these lamps.
    pub fn with_rig(self, rig: Rig) -> Self {
        Self { rig, ..self }
    }

    /// The same profile with K_c of pictures from the depths `[least, most]`, m.
    ///
    /// # Errors
    /// They are not finite and >= 0, or the first is more than the second.
    pub fn with_contrast_depth(self, [least, most]: [f64; 2]) -> Result<Self, ProfileError> {
        if !(least >= 0.0 && most >= least && most.is_finite()) {
            return Err(FieldError::out_of_range(
                "contrast_depth_m",
                "[least, most], finite, 0 <= least <= most (m)",
                format!("[{least}, {most}]"),
            )
            .into());
        }
        Ok(Self {
            contrast_depth_m: Some([least, most]),
            ..self
        })
    }

    /// The same profile with its contrasts without noise beside the published ones.
    ///
    /// # Errors
    /// Distances do not rise from above 0, a contrast is not finite, or a floor is below 0.
    pub fn with_corrected(self, corrected: Corrected) -> Result<Self, ProfileError> {
        corrected.check()?;
        Ok(Self {
            corrected: Some(corrected),
            ..self
        })
    }

    /// K_c without the noise of its pictures, where it is known.
    pub fn corrected(&self) -> Option<&Corrected> {
        self.corrected.as_ref()
    }

    /// Least and most depth of the pictures that K_c was measured in, m, where it is known.
    pub fn contrast_depth_m(&self) -> Option<[f64; 2]> {
        self.contrast_depth_m
    }

    /// How much deeper or shallower than the pictures of K_c a depth is, m; `None` where that is not known.
    pub fn beyond_contrast_depth_m(&self, depth_m: f64) -> Option<f64> {
        let [least, most] = self.contrast_depth_m?;
        Some((least - depth_m).max(depth_m - most).max(0.0))
    }

    /// Camera, sensor and lamps of its pictures, as far as they are known.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// What the profile is too small for, in words.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let (near, far) = self.distance_range_m();
        if near == far {
            warnings.push(format!(
                "the profile knows one distance only ({near} m): no other can be advised; calibrate from several"
            ));
        }
        let (shallow, deep) = self.depth_range_m();
        if shallow == deep {
            warnings.push(format!(
                "the profile knows one depth only ({shallow} m): no advice is given at any other; calibrate at several"
            ));
        }
        warnings
    }

    /// K_z per channel at a depth, no unit.
    pub fn k_z(&self, depth_m: f64) -> Result<[f64; 3], ProfileError> {
        let samples = self.depth.iter().map(|s| (s.depth_m, s.k_z));
        interpolate(samples, depth_m, "depth_m", self.depth_range_m())
    }

    /// K_c per channel with the lamps on from a distance, 8-bit counts.
    pub fn k_c_on(&self, distance_m: f64) -> Result<[f64; 3], ProfileError> {
        let samples = self.contrast_on.iter().map(|s| (s.distance_m, s.k_c));
        interpolate(
            samples,
            distance_m,
            "distance_m",
            distance_range(&self.contrast_on),
        )
    }

    /// K_c per channel with the lamps off from a distance, 8-bit counts.
    pub fn k_c_off(&self, distance_m: f64) -> Result<[f64; 3], ProfileError> {
        let samples = self.contrast_off.iter().map(|s| (s.distance_m, s.k_c));
        interpolate(
            samples,
            distance_m,
            "distance_m",
            distance_range(&self.contrast_off),
        )
    }

    /// Smallest and largest calibrated depth, m.
    pub fn depth_range_m(&self) -> (f64, f64) {
        (
            self.depth[0].depth_m,
            self.depth[self.depth.len() - 1].depth_m,
        )
    }

    /// Smallest and largest distance calibrated both with lamps on and off, m.
    pub fn distance_range_m(&self) -> (f64, f64) {
        let (on, off) = (
            distance_range(&self.contrast_on),
            distance_range(&self.contrast_off),
        );
        (on.0.max(off.0), on.1.min(off.1))
    }

    /// Samples of K_z, depths increasing.
    pub fn depth(&self) -> &[DepthSample] {
        &self.depth
    }

    /// Samples of K_c with the lamps on, distances increasing.
    pub fn contrast_on(&self) -> &[ContrastSample] {
        &self.contrast_on
    }

    /// Samples of K_c with the lamps off, distances increasing.
    pub fn contrast_off(&self) -> &[ContrastSample] {
        &self.contrast_off
    }

    /// Where the profile comes from.
    pub fn source(&self) -> &Source {
        &self.source
    }
}

fn distance_range(samples: &[ContrastSample]) -> (f64, f64) {
    (samples[0].distance_m, samples[samples.len() - 1].distance_m)
}

fn interpolate(
    samples: impl Iterator<Item = (f64, [f64; 3])>,
    at_m: f64,
    what: &'static str,
    (min, max): (f64, f64),
) -> Result<[f64; 3], ProfileError> {
    if !(min..=max).contains(&at_m) {
        return Err(ProfileError::OutsideCalibration {
            what,
            value: at_m,
            min,
            max,
        });
    }
    let mut before: Option<(f64, [f64; 3])> = None;
    for (x, y) in samples {
        if x >= at_m {
            return Ok(match before {
                Some((x0, y0)) => {
                    let t = (at_m - x0) / (x - x0);
                    std::array::from_fn(|k| (1.0 - t) * y0[k] + t * y[k])
                }
                None => y,
            });
        }
        before = Some((x, y));
    }
    Err(ProfileError::OutsideCalibration {
        what,
        value: at_m,
        min,
        max,
    })
}

fn check_samples(
    list: &str,
    position: &str,
    curve: &str,
    samples: &[(f64, [f64; 3])],
) -> Result<(), FieldError> {
    if samples.is_empty() {
        return Err(FieldError::out_of_range(
            list,
            "at least one sample",
            "none",
        ));
    }
    for (i, &(x, y)) in samples.iter().enumerate() {
        if !(x.is_finite() && x >= 0.0) {
            let field = format!("{list}[{i}].{position}");
            return Err(FieldError::out_of_range(field, "finite and >= 0 m", x));
        }
        if i > 0 && x <= samples[i - 1].0 {
            let field = format!("{list}[{i}].{position}");
            let expected = format!("greater than the sample before it ({} m)", samples[i - 1].0);
            return Err(FieldError::out_of_range(field, expected, x));
        }
        if let Some(k) = y.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            let field = format!("{list}[{i}].{curve}[{k}]");
            return Err(FieldError::out_of_range(field, "finite and >= 0", y[k]));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
