//! What sights of earlier pictures tell of the target before the camera.

use std::sync::Arc;

use super::detail::Look;
use super::target::Sight;

/// Error of the logarithm of a deviation from sights of a target of which the present picture does not tell whether it is the same.
const UNCOMPARED: f64 = 0.3;
/// Root of the mean square by which what other channels show may differ from sights that speak for a channel of which the picture tells
/// nothing.
const SAME_TARGET: f64 = 0.2;
/// How far targets are from each other before anything is known of them: the spread of the logarithm of their deviation.
const UNLIKE: f64 = 0.5;
/// Error of the logarithm of the deviation from sights of a target that looks the same here, and how it grows with the logarithm of the
/// distance: another part of it may be before the camera.
const AGREEMENT: [f64; 2] = [0.02, 0.1];
/// Least error of the logarithm of a deviation by which sights are weighed.
const LEAST_ERROR: f64 = 0.02;
/// Correlation of the errors of pictures of the same target.
const COMMON: f64 = 0.7;

/// The present picture's look over the remembered one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Comparison {
    mean: f64,
    deviation: f64,
    /// Of both logarithms the square, less what noise makes of it.
    square: f64,
}

/// Whether what is remembered is news beside what is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Evidence {
    /// Of pictures of their own, perhaps of another target of the kind: it differs everywhere as it does here.
    Own,
    /// Of pictures of the very target, which show much of what the present one shows: what both are off by is the same, and one of its parts differs from
    /// what is remembered, not all.
    Shared,
}

impl Evidence {
    /// How much of the errors is the same.
    fn correlation(self) -> f64 {
        match self {
            Self::Own => 0.0,
            Self::Shared => COMMON,
        }
    }

    /// How much of what differs here differs at another distance, whose logarithm over the present one is `way`: what two parts of one target differ
    /// by is less the less they have in common.
    fn of_part(self, way: f64) -> f64 {
        match self {
            Self::Own => 1.0,
            Self::Shared => (-way.abs()).exp(),
        }
    }
}

/// Sights, compared with the present picture.
#[derive(Debug)]
pub(super) struct Memory {
    /// By rising distance, one for each.
    sights: Arc<[Sight]>,
    comparison: [Option<Comparison>; 3],
}

/// Sights by rising distance, as predictions look them up.
pub(super) fn by_distance(sights: &[Sight]) -> Arc<[Sight]> {
    let mut sights = sights.to_vec();
    sights.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
    sights.into()
}

impl Memory {
    /// Of sights by rising distance, beside what a picture shows `here`.
    pub(super) fn new(sights: Arc<[Sight]>, here: &Sight) -> Self {
        let mut memory = Self {
            sights,
            comparison: [None; 3],
        };
        memory.comparison = [0, 1, 2].map(|k| memory.comparison_with(here, k));
        memory
    }

    /// The sights.
    pub(super) fn sights(&self) -> &[Sight] {
        &self.sights
    }

    /// How the present picture compares in a channel, where both tell.
    pub(super) fn compared(&self, k: usize) -> Option<&Comparison> {
        self.comparison[k].as_ref()
    }

    /// Whether it tells a channel of a target that is before the camera, as other channels show.
    pub(super) fn speaks_for(&self, k: usize) -> bool {
        let told: Vec<f64> = self.comparison.iter().flatten().map(|c| c.square).collect();
        let mean = told.iter().sum::<f64>() / told.len() as f64;
        // Of nothing that is no number.
        mean <= SAME_TARGET * SAME_TARGET && self.sights.iter().any(|sight| sight.tells(k))
    }

    /// How the remembered target looks from `distance_m`, between the sights nearest to it; `None` without any that tells.
    pub(super) fn look(
        &self,
        k: usize,
        distance_m: f64,
        left: &dyn Fn(f64) -> f64,
    ) -> Option<Look<'_>> {
        let usable = || self.sights.iter().filter(|sight| sight.tells(k));
        let nearer = usable().rfind(|sight| sight.distance_m <= distance_m);
        let farther = usable().find(|sight| sight.distance_m > distance_m);
        let (Some(nearer), Some(farther)) = (nearer, farther) else {
            return Some(nearer.or(farther)?.look_on_the_way(k, distance_m, left));
        };
        let share =
            (distance_m / nearer.distance_m).ln() / (farther.distance_m / nearer.distance_m).ln();
        let (near, far) = (
            nearer.look_on_the_way(k, distance_m, left),
            farther.look_on_the_way(k, distance_m, left),
        );
        // The nearer one shows no surroundings, the farther one less detail: the surer of them counts more.
        let near = near.doubted_by(far.deviation, far.error);
        let [of_near, of_far] = [(1.0 - share, &near), (share, &far)]
            .map(|(share, look)| share / (LEAST_ERROR * LEAST_ERROR + look.error * look.error));
        Some(near.towards(&far, of_far / (of_near + of_far)))
    }

    fn comparison_with(&self, here: &Sight, k: usize) -> Option<Comparison> {
        let even = |_: f64| 1.0;
        let known = self.look(k, here.distance_m, &even)?;
        if here.is_blank(k) {
            return None;
        }
        let seen = here.look(k, here.distance_m, &even);
        if !(seen.mean > 0.0 && known.mean > 0.0 && known.deviation > 0.0 && seen.deviation > 0.0) {
            return None;
        }
        // What noise may have made of the difference is not the target's, nor what the sights do not tell of this place.
        let error = here.channel(k).error.hypot(known.error);
        let off = (seen.deviation / known.deviation).ln();
        let kept = UNLIKE * UNLIKE / (UNLIKE * UNLIKE + error * error);
        Some(Comparison {
            mean: seen.mean / known.mean,
            deviation: (kept * off).exp(),
            square: (off * off - error * error).max(0.0) + (seen.mean / known.mean).ln().powi(2),
        })
    }
}

impl Comparison {
    /// What is known, `own`, and what is remembered of there together, `way` being the logarithm of the distance over the present one.
    pub(super) fn of<'a>(
        &self,
        own: &Look<'a>,
        there: Look<'a>,
        way: f64,
        evidence: Evidence,
    ) -> Look<'a> {
        let [at_once, by_way] = AGREEMENT;
        let of_memory = at_once.powi(2) + (by_way * way).powi(2) + 0.5 * self.square;
        let memory_error = of_memory.sqrt().hypot(there.error);
        let of_part = evidence.of_part(way);
        let [mean, deviation] = [self.mean, self.deviation].map(|ratio| ratio.powf(of_part));
        let (own_square, memory_square) = (own.error.powi(2), memory_error.powi(2));
        // The best sum of two values of which so much of the errors is the same, and its error.
        let common = evidence.correlation() * own.error * memory_error;
        let trust = (own_square - common) / (own_square + memory_square - 2.0 * common);
        let trust = trust.clamp(0.0, 1.0);
        let distrust = 1.0 - trust;
        let square = distrust * (distrust * own_square + 2.0 * trust * common)
            + trust * trust * memory_square;
        let blend = |own: f64, memory: f64| match own > 0.0 && memory > 0.0 {
            true => own * (memory / own).powf(trust),
            false => memory,
        };
        let most = match trust > 0.5 {
            true => &there,
            false => own,
        };
        Look {
            mean: blend(own.mean, there.mean * mean),
            deviation: blend(own.deviation, there.deviation * deviation),
            error: square.sqrt(),
            from_m: own.from_m + trust * (there.from_m - own.from_m),
            open: (own.open * distrust).hypot(there.open * deviation * trust),
            shape: most.shape,
            is_hidden: most.is_hidden,
        }
    }
}

/// A remembered look of which nothing tells whether it is of this target.
pub(super) fn uncompared(look: Look<'_>) -> Look<'_> {
    look.with_error(UNCOMPARED)
}

#[cfg(test)]
mod tests;
