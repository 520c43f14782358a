//! Contrast at other distances and lamp levels.

use serde::{Deserialize, Serialize};
use uw_calib::response::CountResponse;

use super::cleared::{LinearPicture, QUANTILES};
use super::detail::{CROP, ChannelDetail, Look, TargetDetail, UNKNOWN};
use super::grid::{PATCHES, slope_variance};
use super::water::{Seen, WaterTables};
use crate::features::Candidate;

/// Mean reflectances that a target may have, with what the error of a veil makes of them.
const REFLECTANCES: std::ops::RangeInclusive<f64> = -0.1..=1.1;
/// Share of clipped pixels beyond which a picture does not tell the target's detail.
const MOST_CLIPPED: f64 = 0.01;
/// Error of a target's look that is taken from the present picture alone, besides what noise and the finest scales leave open: of
/// the logarithm, and how it grows with the logarithm of the distance; from nearer.
const NEARER_ERROR: [f64; 2] = [0.02, 0.04];
/// The same from farther, where the picture does not show the surroundings.
const FARTHER_ERROR: [f64; 2] = [0.02, 0.3];
/// Error of the logarithm of the present picture's deviation from which on it tells nothing.
const LARGEST_ERROR: f64 = 0.5;
/// The same from sights of a target of which the present picture does not tell whether it is the same.
const UNCOMPARED: f64 = 0.3;
/// Error of the tables' light, as a share of the contrast.
const MODEL_ERROR: f64 = 0.01;
/// Error that the rounding of counts leaves, 8-bit counts.
const ROUNDING_COUNTS: f64 = 0.05;
/// Largest error of the logarithm of a deviation with which a sight is remembered.
const MOST_ERROR: f64 = 0.1;
/// How far targets are from each other before anything is known of them: the spread of the logarithm of their deviation.
const UNLIKE: f64 = 0.5;
/// The same from sights of a target that looks the same here: another part of it may be before the camera.
const AGREEMENT: [f64; 2] = [0.02, 0.1];

/// Water, sensor and place of a picture.
#[derive(Clone, Debug)]
pub struct Place<'a> {
    /// The water.
    pub tables: &'a WaterTables,
    /// The sensor.
    pub response: &'a CountResponse,
    /// Linear signal per radiance.
    pub exposure: f64,
    /// What multiplies the tables' daylight, per channel.
    pub daylight: [f64; 3],
    /// What multiplies the tables' lamps, per channel.
    pub lamps: [f64; 3],
    /// Depth, m.
    pub depth_m: f64,
}

/// A picture of a target cleared of the water before it, and from where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sight {
    /// Distance, m.
    pub distance_m: f64,
    detail: TargetDetail,
}

impl Sight {
    /// Of a picture taken at `here`.
    pub fn new(place: &Place, picture: &LinearPicture, here: &Candidate) -> Self {
        let seen = place.seen(here);
        let at = (place.exposure, here.distance_m);
        Self {
            distance_m: here.distance_m,
            detail: TargetDetail::new(picture, place.tables, &seen, at, place.response),
        }
    }

    /// What is wrong with a sight from a file.
    pub(super) fn check(&self) -> Result<(), String> {
        if !(self.distance_m > 0.0 && self.distance_m.is_finite()) {
            return Err(format!(
                "distance_m must be finite and > 0, got {}",
                self.distance_m
            ));
        }
        self.detail.check()
    }

    fn channel(&self, k: usize) -> &ChannelDetail {
        &self.detail.channels[k][0]
    }

    /// How the target looks from `distance_m`; from nearer by the part of the picture that would then be seen.
    fn look(&self, k: usize, distance_m: f64, left: &dyn Fn(f64) -> f64) -> Look<'_> {
        let parts = &self.detail.channels[k];
        let last = parts.len() - 1;
        let nearer = ((distance_m / self.distance_m).ln() / CROP.ln()).clamp(0.0, last as f64);
        let (before, share) = (nearer as usize, nearer.fract());
        let look = |i: usize| parts[i].look(distance_m, self.detail.focal_px, left);
        let wider = look(before);
        match before < last && share > 0.0 {
            true => wider.towards(&look(before + 1), share),
            false => wider,
        }
    }

    /// Whether so many pixels of the channel are clipped that the picture does not tell the target's detail.
    fn is_clipped(&self, k: usize) -> bool {
        self.channel(k).clipped > MOST_CLIPPED
    }

    /// Whether it tells how the target looks.
    fn tells(&self, k: usize) -> bool {
        !self.is_clipped(k) && self.channel(k).error < MOST_ERROR
    }
}

impl Place<'_> {
    fn seen(&self, at: &Candidate) -> Seen {
        let level = 0.01 * at.light_pct;
        let light = (self.daylight, self.lamps);
        self.tables
            .seen(self.depth_m, at.distance_m, level, light.0, light.1)
    }
}

/// A predicted contrast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contrast {
    /// Per channel, 8-bit counts.
    pub counts: [f64; 3],
    /// Their standard errors, 8-bit counts: what the picture, the distance and the memory leave open of the target's detail, and the
    /// tables' own error. Errors of the water that the tables were made for are not in it.
    pub error_counts: [f64; 3],
}

/// Why a picture does not tell a target's detail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// Too many pixels are at full scale.
    Clipped,
    /// The detail cannot be told from the sensor's noise.
    Noise,
    /// No target of this water, light and exposure is as bright or as dark.
    Light,
}

impl std::fmt::Display for Unknown {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::Clipped => {
                "more than 1 % of its pixels are at full scale: lower the exposure or the lamps"
            }
            Self::Light => {
                "no target is as bright or as dark in the water file's water, light and exposure: another of them is before the camera"
            }
            Self::Noise => {
                "its detail cannot be told from the sensor's noise: go nearer or give more light"
            }
        })
    }
}

/// The present picture's look over the remembered one.
#[derive(Clone, Copy, Debug)]
struct Comparison {
    mean: f64,
    deviation: f64,
    /// Of both logarithms the square, less what noise makes of it.
    square: f64,
}

/// Predicts contrast from the present picture and from pictures of the same or another target.
#[derive(Clone, Debug)]
pub struct Predictor<'a> {
    place: Place<'a>,
    here: Sight,
    /// By rising distance, one for each.
    memory: Vec<Sight>,
    /// Measured over predicted deviation here.
    correction: [f64; 3],
}

impl<'a> Predictor<'a> {
    /// From a picture taken at `here` with its published contrast, 8-bit counts, and earlier sights of a target.
    pub fn new(
        place: Place<'a>,
        picture: &LinearPicture,
        (here, contrast): (&Candidate, [f64; 3]),
        memory: &[Sight],
    ) -> Self {
        let sight = Sight::new(&place, picture, here);
        let mut memory = memory.to_vec();
        memory.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        let mut predictor = Self {
            place,
            here: sight,
            memory,
            correction: [1.0; 3],
        };
        let found = predictor.contrast(here).counts;
        predictor.correction =
            std::array::from_fn(
                |k| match predictor.here.is_clipped(k) || !(found[k] > 0.0) {
                    true => 1.0,
                    false => (contrast[k] / found[k]).clamp(0.8, 1.25),
                },
            );
        predictor
    }

    /// Contrast of a picture at the candidate as the published definition has it: the sensor's noise counts.
    pub fn contrast(&self, candidate: &Candidate) -> Contrast {
        let seen = self.place.seen(candidate);
        let mut found = Contrast {
            counts: [0.0; 3],
            error_counts: [0.0; 3],
        };
        for k in 0..3 {
            let left = |frequency: f64| self.place.tables.left_of(&seen.transfer[k], frequency);
            let look = self.look(k, candidate.distance_m, &left);
            let whole = self.over_patches(k, &seen, &look, 1.0);
            let step = 0.1;
            let rise = (self.over_patches(k, &seen, &look, 1.0 + step) - whole) / step;
            let of_detail = rise * look.error.min(1.0);
            let of_model = MODEL_ERROR * whole;
            found.counts[k] = whole;
            found.error_counts[k] = of_detail.hypot(of_model).hypot(ROUNDING_COUNTS);
        }
        found
    }

    /// Mean over patches of the deviation of the stored count, the target's being `times` as large.
    fn over_patches(&self, k: usize, seen: &Seen, look: &Look, times: f64) -> f64 {
        let exposure = self.place.exposure;
        let mean: [f64; PATCHES] =
            std::array::from_fn(|i| seen.veil[k][i] + seen.gain[k][i] * look.mean);
        let slope = slope_variance(&mean);
        let (shape, deviation) = (look.shape, times * look.deviation * self.correction[k]);
        let mut sum = 0.0;
        for i in 0..PATCHES {
            let gain = exposure * seen.gain[k][i];
            let signal = exposure * mean[i] + gain * look.mean * (shape.means[i] - 1.0);
            let own = gain * deviation * shape.deviations[i];
            let spread = (own * own + exposure.powi(2) * slope[i]).sqrt();
            sum += self.counted(signal, spread, &shape.quantiles);
        }
        sum / PATCHES as f64
    }

    /// Per channel why nothing can be said of the target, if so: its light is not that of the tables, or neither the picture nor
    /// a sight tells its detail.
    pub fn unknown(&self) -> [Option<Unknown>; 3] {
        std::array::from_fn(|k| {
            let detail = self.here.channel(k);
            let clipped = self.here.is_clipped(k);
            if !clipped && !REFLECTANCES.contains(&detail.mean) {
                return Some(Unknown::Light);
            }
            if self.memory.iter().any(|sight| sight.tells(k)) {
                return None;
            }
            match (clipped, detail.error >= LARGEST_ERROR) {
                (true, _) => Some(Unknown::Clipped),
                (false, true) => Some(Unknown::Noise),
                (false, false) => None,
            }
        })
    }

    /// Mean reflectance of the target per channel, as the picture and the tables have it.
    pub fn reflectance(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.here.channel(k).mean)
    }

    /// Measured over predicted contrast here.
    pub fn correction(&self) -> [f64; 3] {
        self.correction
    }

    /// How the target looks from `distance_m`.
    fn look(&self, k: usize, distance_m: f64, left: &dyn Fn(f64) -> f64) -> Look<'_> {
        let own = self.here.look(k, distance_m, left);
        let own_error = self.own_error(distance_m, own.error);
        let Some(there) = self.remembered(k, distance_m, left) else {
            return Look {
                error: own_error,
                ..own
            };
        };
        let Some(comparison) = self.compared(k) else {
            // Nothing tells whether it is the same target.
            return Look {
                error: there.error.hypot(UNCOMPARED),
                ..there
            };
        };
        let memory_error = self.memory_error(distance_m, &comparison, there.error);
        let (own_square, memory_square) = (own_error.powi(2), memory_error.powi(2));
        let trust = own_square / (own_square + memory_square);
        let blend = |own: f64, memory: f64| match own > 0.0 && memory > 0.0 {
            true => own * (memory / own).powf(trust),
            false => memory,
        };
        Look {
            mean: blend(own.mean, there.mean * comparison.mean),
            deviation: blend(own.deviation, there.deviation * comparison.deviation),
            error: (own_square * trust).sqrt().min(memory_error),
            shape: match trust > 0.5 {
                true => there.shape,
                false => own.shape,
            },
        }
    }

    /// How the remembered target looks from `distance_m`, between the sights nearest to it; `None` without any that tells.
    fn remembered(&self, k: usize, distance_m: f64, left: &dyn Fn(f64) -> f64) -> Option<Look<'_>> {
        let usable = || self.memory.iter().filter(|sight| sight.tells(k));
        let nearer = usable().rfind(|sight| sight.distance_m <= distance_m);
        let farther = usable().find(|sight| sight.distance_m > distance_m);
        let (Some(nearer), Some(farther)) = (nearer, farther) else {
            return Some(nearer.or(farther)?.look(k, distance_m, left));
        };
        let share =
            (distance_m / nearer.distance_m).ln() / (farther.distance_m / nearer.distance_m).ln();
        let (near, far) = (
            nearer.look(k, distance_m, left),
            farther.look(k, distance_m, left),
        );
        Some(near.towards(&far, share))
    }

    /// The present picture's look over the remembered one; `None` where one of them does not tell.
    fn compared(&self, k: usize) -> Option<Comparison> {
        let even = |_: f64| 1.0;
        let known = self.remembered(k, self.here.distance_m, &even)?;
        let detail = self.here.channel(k);
        if self.here.is_clipped(k) || detail.error >= UNKNOWN {
            return None;
        }
        let seen = self.here.look(k, self.here.distance_m, &even);
        if !(seen.mean > 0.0 && known.mean > 0.0 && known.deviation > 0.0 && seen.deviation > 0.0) {
            return None;
        }
        // What noise may have made of the difference is not the target's.
        let error = detail.error;
        let off = (seen.deviation / known.deviation).ln();
        let kept = UNLIKE * UNLIKE / (UNLIKE * UNLIKE + error * error);
        Some(Comparison {
            mean: seen.mean / known.mean,
            deviation: (kept * off).exp(),
            square: (off * off - error * error).max(0.0) + (seen.mean / known.mean).ln().powi(2),
        })
    }

    /// Error of the logarithm of the deviation from `distance_m` as the present picture has it, which itself is known to `known`.
    fn own_error(&self, distance_m: f64, known: f64) -> f64 {
        let way = (distance_m / self.here.distance_m).ln();
        let [at_once, by_way] = match way < 0.0 {
            true => NEARER_ERROR,
            false => FARTHER_ERROR,
        };
        at_once.hypot(by_way * way).hypot(known)
    }

    /// The same as the memory has it.
    fn memory_error(&self, distance_m: f64, comparison: &Comparison, known: f64) -> f64 {
        let way = (distance_m / self.here.distance_m).ln();
        let [at_once, by_way] = AGREEMENT;
        let square = at_once.powi(2) + (by_way * way).powi(2) + 0.5 * comparison.square;
        square.sqrt().hypot(known)
    }

    /// Deviation of the stored count in a patch of a mean signal and deviation.
    fn counted(&self, signal: f64, deviation: f64, quantiles: &[f64; QUANTILES]) -> f64 {
        let (mut mean, mut square, mut noise) = (0.0, 0.0, 0.0);
        for z in quantiles {
            let (count, variance) = self
                .place
                .response
                .at((signal + deviation * z).max(0.0) as f32);
            let (count, variance) = (f64::from(count), f64::from(variance));
            mean += count;
            square += count * count;
            noise += variance;
        }
        let n = QUANTILES as f64;
        (square / n - (mean / n).powi(2) + noise / n)
            .max(0.0)
            .sqrt()
    }
}
