//! A target as the present picture and earlier sights show it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::cleared::LinearPicture;
use super::detail::{ChannelDetail, Look, TargetDetail, UNKNOWN};
use super::light::Column;
use super::predict::{Place, Unknown};
use crate::features::Candidate;

/// Mean reflectances that a target may have, with what the error of a veil makes of them.
const REFLECTANCES: std::ops::RangeInclusive<f64> = -0.1..=1.1;
/// Share of clipped pixels beyond which a picture does not tell the target's detail.
const MOST_CLIPPED: f64 = 0.01;
/// Error of a target's look that is taken from the present picture alone, besides what noise and the finest scales leave open: of
/// the logarithm, and how it grows with the logarithm of the distance; from nearer.
const NEARER_ERROR: [f64; 2] = [0.01, 0.03];
/// The same from farther, where the picture does not show the surroundings; more where its quarters differ by more.
const FARTHER_ERROR: [f64; 2] = [0.02, 0.3];
/// Error of the logarithm of the present picture's deviation from which on it tells nothing.
const LARGEST_ERROR: f64 = 0.5;
/// The same from sights of a target of which the present picture does not tell whether it is the same.
const UNCOMPARED: f64 = 0.3;
/// Largest error of the logarithm of a deviation with which a sight is remembered.
const MOST_ERROR: f64 = 0.1;
/// Root of the mean square by which what other channels show may differ from sights that speak for a channel of which the picture tells
/// nothing.
const SAME_TARGET: f64 = 0.2;
/// How far targets are from each other before anything is known of them: the spread of the logarithm of their deviation.
const UNLIKE: f64 = 0.5;
/// The same from sights of a target that looks the same here: another part of it may be before the camera.
const AGREEMENT: [f64; 2] = [0.02, 0.1];

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
        Self::in_column(place, &place.column(), picture, here)
    }

    /// The same, where the tables of the depth are made ready already.
    pub(super) fn in_column(
        place: &Place,
        column: &Column,
        picture: &LinearPicture,
        here: &Candidate,
    ) -> Self {
        let seen = place.seen(&column.lit(here.distance_m), here.light_pct);
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
        let patch_m = parts[0].own_patch_m() * distance_m / self.distance_m;
        let after = parts.partition_point(|part| part.own_patch_m() > patch_m);
        let look =
            |i: usize| parts[i].look([self.distance_m, distance_m], self.detail.focal_px, left);
        match (after.checked_sub(1), parts.get(after)) {
            (Some(before), Some(narrower)) => {
                let [from, to] = [&parts[before], narrower].map(|part| part.own_patch_m().ln());
                look(before).towards(&look(after), (patch_m.ln() - from) / (to - from))
            }
            (None, _) => look(0),
            (_, None) => look(parts.len() - 1),
        }
    }

    /// Whether so many pixels of the channel are clipped that the picture does not tell the target's detail.
    pub(super) fn is_clipped(&self, k: usize) -> bool {
        self.channel(k).clipped > MOST_CLIPPED
    }

    /// Whether it tells how the target looks.
    fn tells(&self, k: usize) -> bool {
        !self.is_clipped(k) && self.channel(k).error < MOST_ERROR
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

/// What predictions need of the target before the camera.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) here: Sight,
    /// By rising distance, one for each.
    memory: Arc<[Sight]>,
    comparison: [Option<Comparison>; 3],
}

/// Sights by rising distance, as predictions look them up.
pub(super) fn by_distance(sights: &[Sight]) -> Arc<[Sight]> {
    let mut sights = sights.to_vec();
    sights.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
    sights.into()
}

impl Target {
    /// As a picture shows it, and earlier sights by rising distance.
    pub(super) fn new(here: Sight, memory: Arc<[Sight]>) -> Self {
        let mut target = Self {
            here,
            memory,
            comparison: [None; 3],
        };
        target.comparison = [0, 1, 2].map(|k| target.compared(k));
        target
    }

    /// Per channel why nothing can be said of the target, if so: its light is not that of the tables, or neither the picture nor
    /// a sight tells its detail.
    pub(super) fn unknown(&self) -> [Option<Unknown>; 3] {
        std::array::from_fn(|k| {
            let detail = self.here.channel(k);
            let clipped = self.here.is_clipped(k);
            if !clipped && !REFLECTANCES.contains(&detail.mean) {
                return Some(Unknown::Light);
            }
            let untold = match (clipped, detail.error >= LARGEST_ERROR) {
                (true, _) => Some(Unknown::Clipped),
                (false, true) => Some(Unknown::Noise),
                (false, false) => None,
            };
            let is_remembered = || self.memory.iter().any(|sight| sight.tells(k));
            untold.filter(|_| !(self.is_of_sights() && is_remembered()))
        })
    }

    /// Whether the channels that can be compared show the target that the sights are of.
    fn is_of_sights(&self) -> bool {
        let told: Vec<f64> = self.comparison.iter().flatten().map(|c| c.square).collect();
        let mean = told.iter().sum::<f64>() / told.len() as f64;
        // Of nothing that is no number.
        mean <= SAME_TARGET * SAME_TARGET
    }

    /// Mean reflectance per channel.
    pub(super) fn reflectance(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| self.here.channel(k).mean)
    }

    /// Channels whose mean tells nothing of the target: clipped ones, and those of another light.
    pub(super) fn without_mean(&self) -> [bool; 3] {
        std::array::from_fn(|k| {
            self.here.is_clipped(k) || !REFLECTANCES.contains(&self.here.channel(k).mean)
        })
    }

    /// Standard deviation of the patches' mean reflectances over that of all.
    pub(super) fn spread(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.here.channel(k).shape.spread())
    }

    /// Standard deviation of the patches' deviations over their mean.
    pub(super) fn unevenness(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.here.channel(k).shape.unevenness())
    }

    /// How the target looks from `distance_m`.
    pub(super) fn look(&self, k: usize, distance_m: f64, left: &dyn Fn(f64) -> f64) -> Look<'_> {
        let own = self.here.look(k, distance_m, left);
        let own_error = self.own_error(k, distance_m, own.error);
        let Some(there) = self.remembered(k, distance_m, left) else {
            return Look {
                error: own_error,
                ..own
            };
        };
        let Some(comparison) = &self.comparison[k] else {
            // Nothing tells whether it is the same target.
            return uncompared(there);
        };
        let memory_error = self.memory_error(distance_m, comparison, there.error);
        let (own_square, memory_square) = (own_error.powi(2), memory_error.powi(2));
        let trust = own_square / (own_square + memory_square);
        let blend = |own: f64, memory: f64| match own > 0.0 && memory > 0.0 {
            true => own * (memory / own).powf(trust),
            false => memory,
        };
        Look {
            mean: blend(own.mean, there.mean * comparison.mean),
            deviation: blend(own.deviation, there.deviation * comparison.deviation),
            error: (memory_square * trust).sqrt(),
            from_m: own.from_m + trust * (there.from_m - own.from_m),
            open: (own.open * (1.0 - trust)).hypot(there.open * comparison.deviation * trust),
            shape: match trust > 0.5 {
                true => there.shape,
                false => own.shape,
            },
            is_hidden: match trust > 0.5 {
                true => there.is_hidden,
                false => own.is_hidden,
            },
        }
    }

    /// How it looks if the sights are of it, whatever the present picture shows.
    pub(super) fn look_of_sights(
        &self,
        k: usize,
        distance_m: f64,
        left: &dyn Fn(f64) -> f64,
    ) -> Option<Look<'_>> {
        self.remembered(k, distance_m, left).map(uncompared)
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
    fn own_error(&self, k: usize, distance_m: f64, known: f64) -> f64 {
        let way = (distance_m / self.here.distance_m).ln();
        if way < 0.0 {
            let [at_once, by_way] = NEARER_ERROR;
            return at_once.hypot(by_way * way).hypot(known);
        }
        let [at_once, by_way] = FARTHER_ERROR;
        // A picture is to a view twice as wide what a quarter is to the picture, and each doubling adds its own.
        let doublings = way / std::f64::consts::LN_2;
        let unlike = self.here.channel(k).shape.unlikeness() * doublings.sqrt();
        at_once.hypot((by_way * way).max(unlike)).hypot(known)
    }

    /// The same as the memory has it.
    fn memory_error(&self, distance_m: f64, comparison: &Comparison, known: f64) -> f64 {
        let way = (distance_m / self.here.distance_m).ln();
        let [at_once, by_way] = AGREEMENT;
        let square = at_once.powi(2) + (by_way * way).powi(2) + 0.5 * comparison.square;
        square.sqrt().hypot(known)
    }
}

/// A remembered look of which nothing tells whether it is of this target.
fn uncompared(look: Look<'_>) -> Look<'_> {
    Look {
        error: look.error.hypot(UNCOMPARED),
        ..look
    }
}

#[cfg(test)]
mod tests;
