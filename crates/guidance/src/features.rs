//! The network's inputs: one table of name, unit and meaning.
//!
//! A model file lists input names in its own order; loading compares names and units with this table, and
//! nothing else in the program refers to an input by its position.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use uw_calib::{ContrastSample, Profile, ProfileError};

use crate::observation::Observation;

/// A distance and a lamp level that the vehicle could take next.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Candidate {
    /// Distance to the target, m.
    pub distance_m: f64,
    /// Lamp level, percent of full intensity.
    pub light_pct: f64,
}

/// The calibrated contrast over distance, for inputs that look at the candidate's place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContrastCurves {
    on: Arc<[ContrastSample]>,
    off: Arc<[ContrastSample]>,
}

impl ContrastCurves {
    /// The curves of a profile.
    pub fn of(profile: &Profile) -> Self {
        Self {
            on: profile.contrast_on().into(),
            off: profile.contrast_off().into(),
        }
    }

    /// K_c with lamps on at a distance in m, 8-bit counts: linear between samples, the outermost ones beyond them,
    /// 0 without a profile.
    pub fn on(&self, distance_m: f64) -> [f64; 3] {
        along(&self.on, distance_m)
    }

    /// The same with lamps off.
    pub fn off(&self, distance_m: f64) -> [f64; 3] {
        along(&self.off, distance_m)
    }
}

fn along(samples: &[ContrastSample], distance_m: f64) -> [f64; 3] {
    let after = samples.partition_point(|s| s.distance_m < distance_m);
    match (
        after.checked_sub(1).map(|i| &samples[i]),
        samples.get(after),
    ) {
        (Some(a), Some(b)) => {
            let t = (distance_m - a.distance_m) / (b.distance_m - a.distance_m);
            std::array::from_fn(|k| (1.0 - t) * a.k_c[k] + t * b.k_c[k])
        }
        (Some(end), None) | (None, Some(end)) => end.k_c,
        (None, None) => [0.0; 3],
    }
}

/// What stays the same for all candidates: the observation and the calibration at its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Situation {
    /// K_z at the current depth, no unit.
    pub k_z: [f64; 3],
    /// K_c with lamps on at the current distance, 8-bit counts.
    pub k_c_on: [f64; 3],
    /// K_c with lamps off at the current distance, 8-bit counts.
    pub k_c_off: [f64; 3],
    /// What the vehicle knows.
    pub observation: Observation,
    /// K_c over distance.
    pub curves: ContrastCurves,
}

impl Situation {
    /// What is known without a calibration: all curves 0.
    pub fn without_profile(observation: &Observation) -> Self {
        Self {
            k_z: [0.0; 3],
            k_c_on: [0.0; 3],
            k_c_off: [0.0; 3],
            observation: *observation,
            curves: ContrastCurves::default(),
        }
    }

    /// Looks the calibration up; fails outside the calibrated depths and distances.
    pub fn new(observation: &Observation, profile: &Profile) -> Result<Self, ProfileError> {
        Ok(Self {
            k_z: profile.k_z(observation.depth_m)?,
            k_c_on: profile.k_c_on(observation.distance_m)?,
            k_c_off: profile.k_c_off(observation.distance_m)?,
            observation: *observation,
            curves: ContrastCurves::of(profile),
        })
    }
}

/// Value of an input that differs from candidate to candidate.
pub type VaryingValue = fn(&Situation, &Candidate) -> f64;

/// How the value of an input is found.
#[derive(Clone, Copy, Debug)]
pub enum FeatureValue {
    /// The same for all candidates of one question.
    Fixed(fn(&Situation) -> f64),
    /// Different from candidate to candidate.
    Varying(VaryingValue),
}

/// One input of the network.
#[derive(Clone, Copy, Debug)]
pub struct Feature {
    /// Name in model files.
    pub name: &'static str,
    /// Unit in model files.
    pub unit: &'static str,
    /// Its value.
    pub value: FeatureValue,
}

const fn fixed(name: &'static str, unit: &'static str, of: fn(&Situation) -> f64) -> Feature {
    Feature {
        name,
        unit,
        value: FeatureValue::Fixed(of),
    }
}

const fn varying(name: &'static str, unit: &'static str, of: VaryingValue) -> Feature {
    Feature {
        name,
        unit,
        value: FeatureValue::Varying(of),
    }
}

/// Unit of contrasts and means.
pub const COUNTS: &str = "8bit_counts";

/// All inputs a model can have: the fixed ones all, one of the two pairs after them, and all or none of the last six.
pub static FEATURES: [Feature; 28] = [
    fixed("kz_r", "1", |s| s.k_z[0]),
    fixed("kz_g", "1", |s| s.k_z[1]),
    fixed("kz_b", "1", |s| s.k_z[2]),
    fixed("kc_on_r", COUNTS, |s| s.k_c_on[0]),
    fixed("kc_on_g", COUNTS, |s| s.k_c_on[1]),
    fixed("kc_on_b", COUNTS, |s| s.k_c_on[2]),
    fixed("kc_off_r", COUNTS, |s| s.k_c_off[0]),
    fixed("kc_off_g", COUNTS, |s| s.k_c_off[1]),
    fixed("kc_off_b", COUNTS, |s| s.k_c_off[2]),
    fixed("distance", "m", |s| s.observation.distance_m),
    fixed("light", "percent", |s| s.observation.light_pct),
    fixed("depth", "m", |s| s.observation.depth_m),
    fixed("mean_r", COUNTS, |s| s.observation.mean[0]),
    fixed("mean_g", COUNTS, |s| s.observation.mean[1]),
    fixed("mean_b", COUNTS, |s| s.observation.mean[2]),
    fixed("std_r", COUNTS, |s| s.observation.std[0]),
    fixed("std_g", COUNTS, |s| s.observation.std[1]),
    fixed("std_b", COUNTS, |s| s.observation.std[2]),
    varying("delta_distance", "m", |s, c| {
        c.distance_m - s.observation.distance_m
    }),
    varying("delta_light", "percent", |s, c| {
        c.light_pct - s.observation.light_pct
    }),
    varying("target_distance", "m", |_, c| c.distance_m),
    varying("target_light", "percent", |_, c| c.light_pct),
    varying("target_kc_on_r", COUNTS, |s, c| {
        s.curves.on(c.distance_m)[0]
    }),
    varying("target_kc_on_g", COUNTS, |s, c| {
        s.curves.on(c.distance_m)[1]
    }),
    varying("target_kc_on_b", COUNTS, |s, c| {
        s.curves.on(c.distance_m)[2]
    }),
    varying("target_kc_off_r", COUNTS, |s, c| {
        s.curves.off(c.distance_m)[0]
    }),
    varying("target_kc_off_g", COUNTS, |s, c| {
        s.curves.off(c.distance_m)[1]
    }),
    varying("target_kc_off_b", COUNTS, |s, c| {
        s.curves.off(c.distance_m)[2]
    }),
];

/// The inputs that tell candidates apart, of which a model has exactly one pair.
pub const CANDIDATE_PAIRS: [[&str; 2]; 2] = [
    ["delta_distance", "delta_light"],
    ["target_distance", "target_light"],
];

/// The calibration at the candidate's distance; a model has all of them or none.
pub const TARGET_PROFILE: [&str; 6] = [
    "target_kc_on_r",
    "target_kc_on_g",
    "target_kc_on_b",
    "target_kc_off_r",
    "target_kc_off_g",
    "target_kc_off_b",
];

/// The input of that name.
pub fn feature(name: &str) -> Option<&'static Feature> {
    FEATURES.iter().find(|feature| feature.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples at 28 and 30 m, `at` and 2 more, rising by 1 from channel to channel.
    fn curve(at: f64) -> Arc<[ContrastSample]> {
        let sample = |distance_m, at| ContrastSample {
            distance_m,
            k_c: [at, at + 1.0, at + 2.0],
        };
        [sample(28.0, at), sample(30.0, at + 2.0)].into()
    }

    #[test]
    fn curves_end_in_their_outermost_samples() {
        let curves = ContrastCurves {
            on: curve(5.0),
            off: Arc::default(),
        };
        assert_eq!((curves.on(1.0)[0], curves.on(99.0)[0]), (5.0, 7.0));
        assert_eq!(curves.off(1.0), [0.0; 3]);
    }

    #[test]
    fn names_are_unique_and_values_are_their_own() {
        let situation = Situation {
            k_z: [1.0, 2.0, 3.0],
            k_c_on: [4.0, 5.0, 6.0],
            k_c_off: [7.0, 8.0, 9.0],
            observation: Observation {
                distance_m: 10.0,
                light_pct: 11.0,
                depth_m: 12.0,
                mean: [13.0, 14.0, 15.0],
                std: [16.0, 17.0, 18.0],
                quality: None,
            },
            curves: ContrastCurves {
                on: curve(40.0),
                off: curve(50.0),
            },
        };
        let candidate = Candidate {
            distance_m: 29.0,
            light_pct: 31.0,
        };
        for (k, feature) in FEATURES.iter().enumerate() {
            let value = match feature.value {
                FeatureValue::Fixed(of) => of(&situation),
                FeatureValue::Varying(of) => of(&situation, &candidate),
            };
            let expected = match k {
                0..18 => (k + 1) as f64,
                18 => 19.0,
                19 => 20.0,
                20 => 29.0,
                21 => 31.0,
                // Halfway between samples at 28 and 30 m.
                22..25 => 41.0 + (k - 22) as f64,
                _ => 51.0 + (k - 25) as f64,
            };
            assert_eq!(value, expected, "{}", feature.name);
            assert_eq!(
                self::feature(feature.name).map(|f| f.name),
                Some(feature.name)
            );
        }
    }
}
