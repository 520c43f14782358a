//! A target as the present picture and earlier sights show it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::cleared::LinearPicture;
use super::detail::{ChannelDetail, Look, TargetDetail, UNKNOWN};
use super::light::Column;
use super::memory::{Evidence, Memory, uncompared};
use super::predict::{Place, Unknown};
use crate::features::Candidate;

/// Mean reflectances that a target may have, with what the error of a veil makes of them.
const REFLECTANCES: std::ops::RangeInclusive<f64> = -0.1..=1.1;
/// Share of pixels at full scale beyond which a picture does not tell the target's detail.
const MOST_CLIPPED: f64 = 0.1;
/// The same for what is told without ado: the target's mean reflectance, where pictures are compared by it.
const MOST_CLIPPED_UNTOLD: f64 = 0.01;
/// Error of a target's look that is taken from the present picture alone, besides what noise and the finest scales leave open: of
/// the logarithm, and how it grows with the logarithm of the distance; from nearer.
const NEARER_ERROR: [f64; 2] = [0.01, 0.03];
/// The same from farther, where the picture does not show the surroundings; more where its quarters differ by more.
const FARTHER_ERROR: [f64; 2] = [0.02, 0.3];
/// Error of the logarithm of the present picture's deviation from which on it tells nothing.
const LARGEST_ERROR: f64 = 0.5;
/// Largest error of the logarithm of a deviation with which a sight is remembered.
const MOST_ERROR: f64 = 0.1;

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

    pub(super) fn channel(&self, k: usize) -> &ChannelDetail {
        &self.detail.channels[k][0]
    }

    /// How the target looks from `distance_m` as far as this sight alone tells.
    fn look_alone(&self, k: usize, distance_m: f64, left: &dyn Fn(f64) -> f64) -> Look<'_> {
        let [at_once, _] = match distance_m < self.distance_m {
            true => NEARER_ERROR,
            false => FARTHER_ERROR,
        };
        self.look_on_the_way(k, distance_m, left)
            .with_error(at_once)
    }

    /// The same with the error of the way there alone.
    pub(super) fn look_on_the_way(
        &self,
        k: usize,
        distance_m: f64,
        left: &dyn Fn(f64) -> f64,
    ) -> Look<'_> {
        self.look(k, distance_m, left)
            .with_error(self.error_by_way(k, distance_m))
    }

    /// Error of the logarithm of the deviation from another distance that the way there makes.
    fn error_by_way(&self, k: usize, distance_m: f64) -> f64 {
        let way = (distance_m / self.distance_m).ln();
        if way < 0.0 {
            let [_, by_way] = NEARER_ERROR;
            return by_way * -way;
        }
        let [_, by_way] = FARTHER_ERROR;
        // A picture is to a view twice as wide what a quarter is to the picture, and each doubling adds its own.
        let doublings = way / std::f64::consts::LN_2;
        let unlike = self.channel(k).shape.unlikeness() * doublings.sqrt();
        (by_way * way).max(unlike)
    }

    /// How the target looks from `distance_m`; from nearer by the part of the picture that would then be seen.
    pub(super) fn look(&self, k: usize, distance_m: f64, left: &dyn Fn(f64) -> f64) -> Look<'_> {
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

    /// Whether it shows nothing at all of the channel's detail.
    pub(super) fn is_blank(&self, k: usize) -> bool {
        self.is_clipped(k) || self.channel(k).error >= UNKNOWN
    }

    /// Whether it tells how the target looks in any channel.
    pub fn tells_any(&self) -> bool {
        (0..3).any(|k| self.tells(k))
    }

    /// Whether it tells how the target looks.
    pub(super) fn tells(&self, k: usize) -> bool {
        let channel = self.channel(k);
        !self.is_clipped(k) && channel.error < MOST_ERROR && REFLECTANCES.contains(&channel.mean)
    }
}

/// What predictions need of the target before the camera.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) here: Sight,
    /// What the vehicle saw on its way.
    earlier: Memory,
    /// What the water file knows.
    filed: Memory,
}

/// What is asked besides the present picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    /// The water file's sights.
    File,
    /// These and the vehicle's earlier pictures.
    All,
}

impl Target {
    /// As a picture shows it, and earlier sights by rising distance: of the vehicle on its way, and of the water file.
    pub(super) fn new(here: Sight, earlier: Arc<[Sight]>, filed: Arc<[Sight]>) -> Self {
        Self {
            earlier: Memory::new(earlier, &here),
            filed: Memory::new(filed, &here),
            here,
        }
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
            let memories = [&self.earlier, &self.filed];
            untold.filter(|_| !memories.iter().any(|memory| memory.speaks_for(k)))
        })
    }

    /// Distances of what the vehicle saw on its way, rising, m.
    pub(super) fn earlier_m(&self) -> Vec<f64> {
        let sights = self.earlier.sights().iter();
        sights.map(|sight| sight.distance_m).collect()
    }

    /// Mean reflectance per channel.
    pub(super) fn reflectance(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| self.here.channel(k).mean)
    }

    /// Channels whose mean tells nothing of the target: clipped ones, and those of another light.
    pub(super) fn without_mean(&self) -> [bool; 3] {
        std::array::from_fn(|k| {
            let channel = self.here.channel(k);
            channel.clipped > MOST_CLIPPED_UNTOLD || !REFLECTANCES.contains(&channel.mean)
        })
    }

    /// Channels of which more than a hundredth is at full scale and not so much that they tell nothing.
    pub(super) fn partly_clipped(&self) -> [bool; 3] {
        std::array::from_fn(|k| {
            !self.here.is_clipped(k) && self.here.channel(k).clipped > MOST_CLIPPED_UNTOLD
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
    pub(super) fn look(
        &self,
        asked: Asked,
        k: usize,
        distance_m: f64,
        left: &dyn Fn(f64) -> f64,
    ) -> Look<'_> {
        let way = (distance_m / self.here.distance_m).ln();
        let earlier = (asked == Asked::All).then_some((&self.earlier, Evidence::Shared));
        let memories = earlier.into_iter().chain([(&self.filed, Evidence::Own)]);
        let mut look = self.here.look_alone(k, distance_m, left);
        let is_blank = self.here.is_blank(k) || !(look.deviation > 0.0);
        for (memory, evidence) in memories {
            let Some(there) = memory.look(k, distance_m, left) else {
                continue;
            };
            match memory.compared(k) {
                Some(comparison) => look = comparison.of(&look, there, way, evidence),
                // The picture tells nothing, not even whether it is the same target.
                None if is_blank => return uncompared(there),
                None => {}
            }
        }
        look
    }

    /// How it looks if the water file's sights are of it, whatever the present picture shows.
    pub(super) fn look_of_sights(
        &self,
        k: usize,
        distance_m: f64,
        left: &dyn Fn(f64) -> f64,
    ) -> Option<Look<'_>> {
        self.filed.look(k, distance_m, left).map(uncompared)
    }
}

#[cfg(test)]
mod tests;
