//! Measurements of a calibration routine become a profile.
//!
//! The routine has two steps: looking up to the surface at several depths, and looking at the target
//! from several distances, once with the lamps on and once with them off. [`from_manifest`](crate::from_manifest) does
//! with less.

use thiserror::Error;

use crate::manifest::ManifestError;
use crate::profile::{ContrastSample, DepthSample, Profile, ProfileError, Source};
use crate::stats::StatsError;

/// Why measurements give no profile.
#[derive(Debug, Error)]
pub enum CalibrateError {
    /// The manifest cannot be used.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// An image of the manifest cannot be measured.
    #[error("{manifest}:{line}: {source}")]
    Image {
        /// Manifest.
        manifest: String,
        /// Line, from 1.
        line: u64,
        /// What is wrong with the image.
        source: StatsError,
    },
    /// The pictures of a manifest are too few for a profile.
    #[error("{manifest}: too few pictures for a profile\n{has}  lacks {}", .lacks.join("\n  lacks "))]
    Incomplete {
        /// Manifest.
        manifest: String,
        /// What it has, a line each.
        has: String,
        /// What it lacks, and what for.
        lacks: Vec<&'static str>,
    },
    /// K_z cannot be had from what there is.
    #[error("{manifest}: K_z: {reason}")]
    Daylight {
        /// Manifest.
        manifest: String,
        /// Why not.
        reason: String,
    },
    /// No distance has what the lamp level needs.
    #[error(
        "{manifest}: no distance has a picture with the lamps at {light_pct} %, or two at other levels (the lamps off is one) to derive it from"
    )]
    NoLevel {
        /// Manifest.
        manifest: String,
        /// Lamp level, percent.
        light_pct: f64,
    },
    /// A part of the routine is missing.
    #[error("the calibration must hold {what}, got none")]
    Missing {
        /// What is missing.
        what: &'static str,
    },
    /// The shallowest image is black in a channel, so K_z has no reference.
    #[error(
        "the mean of channel {channel} at the shallowest depth ({depth_m} m) must be > 0 as reference of K_z, got {mean}"
    )]
    NoReference {
        /// R, G or B.
        channel: char,
        /// Shallowest depth, m.
        depth_m: f64,
        /// Mean, 8-bit counts.
        mean: f64,
    },
    /// The lights-on images were taken at different lamp levels.
    #[error(
        "all contrast images with the lamps on must have the same light_pct, got {first} and {second}"
    )]
    MixedLampLevels {
        /// One level, percent.
        first: f64,
        /// Another level, percent.
        second: f64,
    },
    /// Pictures of the target have different sizes; contrast depends on it.
    #[error(
        "{manifest}:{line}: all contrast images must have the same size, got {} x {} and {} x {} pixels", first[0], first[1], second[0], second[1]
    )]
    MixedSizes {
        /// Manifest.
        manifest: String,
        /// Line, from 1.
        line: u64,
        /// Width and height of those before, pixels.
        first: [u32; 2],
        /// Of this one, pixels.
        second: [u32; 2],
    },
    /// A picture of the target has another size than the vehicle's.
    #[error(
        "{manifest}:{line}: pictures of the target must have the vehicle's {} x {} pixels, got {} x {}", vehicle[0], vehicle[1], got[0], got[1]
    )]
    OtherSize {
        /// Manifest.
        manifest: String,
        /// Line, from 1.
        line: u64,
        /// Width and height of the vehicle's pictures, pixels.
        vehicle: [f64; 2],
        /// Of this one, pixels.
        got: [u32; 2],
    },
    /// The measurements make no valid profile.
    #[error(transparent)]
    Profile(#[from] ProfileError),
}

/// Mean of an image that looks up to the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthMeasurement {
    /// Depth, m, >= 0.
    pub depth_m: f64,
    /// Mean per channel, 8-bit counts.
    pub mean: [f64; 3],
}

/// Contrast of an image that looks at the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContrastMeasurement {
    /// Distance, m, > 0.
    pub distance_m: f64,
    /// Lamp level, percent; 0 is off.
    pub light_pct: f64,
    /// Contrast per channel, 8-bit counts.
    pub contrast: [f64; 3],
}

impl Profile {
    /// A profile from measurements in any order; several at one depth, or at one distance with the same
    /// lamp state, are averaged.
    pub fn from_measurements(
        depth: &[DepthMeasurement],
        contrast: &[ContrastMeasurement],
        source: Source,
    ) -> Result<Self, CalibrateError> {
        check_lamp_levels(contrast)?;
        let lamps = |on: bool| {
            average(
                contrast
                    .iter()
                    .filter(|m| (m.light_pct > 0.0) == on)
                    .map(|m| (m.distance_m, m.contrast)),
            )
            .into_iter()
            .map(|(distance_m, k_c)| ContrastSample { distance_m, k_c })
            .collect::<Vec<_>>()
        };
        let (on, off) = (lamps(true), lamps(false));
        if on.is_empty() {
            return Err(CalibrateError::Missing {
                what: "contrast images with the lamps on",
            });
        }
        if off.is_empty() {
            return Err(CalibrateError::Missing {
                what: "contrast images with the lamps off (light_pct 0)",
            });
        }
        Ok(Self::new(relative_to_shallowest(depth)?, on, off, source)?)
    }
}

/// K_z of pictures that look up: their mean counts over those of the shallowest, by rising depth; of equal depths the mean.
///
/// # Errors
/// There is none, or a channel of the shallowest is black.
pub fn relative_to_shallowest(
    depth: &[DepthMeasurement],
) -> Result<Vec<DepthSample>, CalibrateError> {
    let means = average(depth.iter().map(|m| (m.depth_m, m.mean)));
    let Some(&(depth_m, reference)) = means.first() else {
        return Err(CalibrateError::Missing {
            what: "images of kind depth",
        });
    };
    if let Some(k) = (0..3).find(|&k| reference[k].is_nan() || reference[k] <= 0.0) {
        return Err(CalibrateError::NoReference {
            channel: ['R', 'G', 'B'][k],
            depth_m,
            mean: reference[k],
        });
    }
    Ok(means
        .into_iter()
        .map(|(depth_m, mean)| DepthSample {
            depth_m,
            k_z: std::array::from_fn(|k| mean[k] / reference[k]),
        })
        .collect())
}

fn check_lamp_levels(contrast: &[ContrastMeasurement]) -> Result<(), CalibrateError> {
    let mut levels = contrast
        .iter()
        .map(|m| m.light_pct)
        .filter(|&level| level > 0.0);
    let Some(first) = levels.next() else {
        return Ok(());
    };
    match levels.find(|&level| level != first) {
        None => Ok(()),
        Some(second) => Err(CalibrateError::MixedLampLevels { first, second }),
    }
}

/// Sorts by position and averages the values that share one.
pub(crate) fn average(values: impl Iterator<Item = (f64, [f64; 3])>) -> Vec<(f64, [f64; 3])> {
    let mut values: Vec<_> = values.collect();
    values.sort_by(|x, y| x.0.total_cmp(&y.0));
    values
        .chunk_by(|x, y| x.0 == y.0)
        .map(|group| {
            let sum = |k: usize| group.iter().map(|(_, value)| value[k]).sum::<f64>();
            (
                group[0].0,
                std::array::from_fn(|k| sum(k) / group.len() as f64),
            )
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source() -> Source {
        Source {
            made_by: "test".to_owned(),
            images: 0,
            note: None,
        }
    }

    fn depth(depth_m: f64, mean: [f64; 3]) -> DepthMeasurement {
        DepthMeasurement { depth_m, mean }
    }

    fn contrast(distance_m: f64, light_pct: f64, value: f64) -> ContrastMeasurement {
        ContrastMeasurement {
            distance_m,
            light_pct,
            contrast: [value; 3],
        }
    }

    #[test]
    fn k_z_is_relative_to_the_shallowest_depth_and_k_c_split_by_lamp() {
        let profile = Profile::from_measurements(
            &[
                depth(3.0, [20.0, 50.0, 40.0]),
                depth(0.5, [100.0, 100.0, 80.0]),
            ],
            &[
                contrast(2.0, 0.0, 3.0),
                contrast(1.0, 0.0, 6.0),
                contrast(1.0, 80.0, 9.0),
                contrast(2.0, 80.0, 4.0),
            ],
            source(),
        )
        .unwrap();
        assert_eq!(profile.k_z(0.5).unwrap(), [1.0; 3]);
        assert_eq!(profile.k_z(3.0).unwrap(), [0.2, 0.5, 0.5]);
        assert_eq!(profile.k_c_on(1.0).unwrap(), [9.0; 3]);
        assert_eq!(profile.k_c_off(2.0).unwrap(), [3.0; 3]);
    }

    #[test]
    fn images_at_one_place_are_averaged() {
        let profile = Profile::from_measurements(
            &[
                depth(1.0, [10.0; 3]),
                depth(1.0, [30.0; 3]),
                depth(2.0, [10.0; 3]),
            ],
            &[
                contrast(1.0, 0.0, 6.0),
                contrast(1.0, 0.0, 8.0),
                contrast(1.0, 50.0, 9.0),
            ],
            source(),
        )
        .unwrap();
        assert_eq!(profile.k_z(2.0).unwrap(), [0.5; 3]);
        assert_eq!(profile.k_c_off(1.0).unwrap(), [7.0; 3]);
    }

    #[test]
    fn incomplete_or_contradictory_routines_are_refused() {
        let good_depth = [depth(1.0, [10.0; 3])];
        let both = [contrast(1.0, 0.0, 6.0), contrast(1.0, 50.0, 9.0)];
        let cases: [(&[DepthMeasurement], &[ContrastMeasurement], &str); 5] = [
            (&[], &both, "images of kind depth"),
            (&good_depth, &both[..1], "with the lamps on"),
            (&good_depth, &both[1..], "with the lamps off"),
            (
                &[depth(1.0, [10.0, 0.0, 10.0])],
                &both,
                "channel G at the shallowest depth (1 m)",
            ),
            (
                &good_depth,
                &[both[0], both[1], contrast(2.0, 100.0, 3.0)],
                "same light_pct, got 50 and 100",
            ),
        ];
        for (depth, contrast, expected) in cases {
            let error = Profile::from_measurements(depth, contrast, source()).unwrap_err();
            assert!(error.to_string().contains(expected), "{error}");
        }
    }
}
