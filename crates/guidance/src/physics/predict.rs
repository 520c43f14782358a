//! Contrast at other distances and lamp levels.

use std::sync::Arc;

use uw_calib::response::CountResponse;

use super::blocks::Blocks;
use super::cleared::LinearPicture;
use super::detail::Look;
use super::doubt::WaterDoubt;
use super::grid::{PATCHES, slope_variance};
use super::light::{Column, Lit, Seen};
use super::memory::by_distance;
use super::shape::Quantiles;
use super::target::{Asked, Sight, Target};
use super::water::WaterTables;
use crate::features::Candidate;

/// Error of the tables' light, as a share of the contrast.
const MODEL_ERROR: f64 = 0.01;
/// Error that rounding and the closed form leave where contrast is next to noise alone, 8-bit counts.
const ROUNDING_COUNTS: f64 = 0.08;
/// Least of the deviation measured over that predicted here which is put down to the closed form.
const LEAST_CORRECTION: f64 = 0.8;

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
    /// What is open of the water; `None` where it is known.
    pub doubt: Option<WaterDoubt>,
}

impl Place<'_> {
    /// The tables at this depth.
    pub(super) fn column(&self) -> Column {
        Column::new(self.tables, self.depth_m)
    }

    /// A view under this light.
    pub(super) fn seen<'l>(&self, lit: &Lit<'l>, light_pct: f64) -> Seen<'l> {
        let lamps = self.lamps.map(|lamps| 0.01 * light_pct * lamps);
        lit.seen(self.daylight, lamps)
    }
}

/// A predicted contrast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contrast {
    /// Per channel, 8-bit counts.
    pub counts: [f64; 3],
    /// Their standard errors, 8-bit counts: what the picture, the distance and the memory leave open of the target's detail, what a fit
    /// leaves open of the water, and the tables' own error.
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
                "more than 10 % of its pixels are at full scale: lower the exposure or the lamps"
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

/// What is made once of a picture: the tables of its depth, and the target that it shows.
#[derive(Debug)]
pub(super) struct Known {
    column: Column,
    target: Target,
    /// Share of the lamps in the light on the target, per channel.
    lamps: [f64; 3],
}

impl Known {
    /// What the picture shows of the target.
    pub(super) fn sight(&self) -> &Sight {
        &self.target.here
    }

    /// Distances of what the vehicle saw earlier on its way, rising, m.
    pub(super) fn earlier_m(&self) -> Vec<f64> {
        self.target.earlier_m()
    }

    /// Spread of the detail's deviation from patch to patch over its mean, per channel.
    pub(super) fn unevenness(&self) -> [f64; 3] {
        self.target.unevenness()
    }
}

/// Predicts contrast from the present picture and from pictures of the same or another target.
#[derive(Clone, Debug)]
pub struct Predictor<'a> {
    place: Place<'a>,
    known: Arc<Known>,
    /// Measured over predicted deviation here.
    correction: [f64; 3],
    asked: Asked,
}

/// Sights by rising distance.
#[derive(Debug)]
pub(super) struct Sights {
    /// Of the vehicle on its way.
    pub(super) earlier: Arc<[Sight]>,
    /// Of the water file.
    pub(super) filed: Arc<[Sight]>,
}

impl<'a> Predictor<'a> {
    /// From a picture taken at `here` with its published contrast, 8-bit counts, and the sights of a water file.
    pub fn new(
        place: Place<'a>,
        picture: &LinearPicture,
        now: (&Candidate, [f64; 3]),
        filed: &[Sight],
    ) -> Self {
        Self::on_the_way(place, picture, now, [&[], filed])
    }

    /// The same with what the vehicle saw earlier on its way, best from where the present picture is not: of its `[earlier, filed]` sights the former
    /// are taken to show the target before the camera unless the present picture says otherwise.
    pub fn on_the_way(
        place: Place<'a>,
        picture: &LinearPicture,
        (here, contrast): (&Candidate, [f64; 3]),
        [earlier, filed]: [&[Sight]; 2],
    ) -> Self {
        let sights = Sights {
            earlier: by_distance(earlier),
            filed: by_distance(filed),
        };
        let contrast = picture.own_contrast(contrast, place.response);
        Self::remembering(place, picture, (here, contrast), sights)
    }

    /// The same with sights by rising distance, and the contrast as it would be with the water file's noise.
    pub(super) fn remembering(
        place: Place<'a>,
        picture: &LinearPicture,
        (here, contrast): (&Candidate, [f64; 3]),
        sights: Sights,
    ) -> Self {
        let column = place.column();
        let sight = Sight::in_column(&place, &column, picture, here);
        let target = Target::new(sight, sights.earlier, sights.filed);
        let lamps = place
            .seen(&column.lit(here.distance_m), here.light_pct)
            .lamps;
        let known = Arc::new(Known {
            column,
            target,
            lamps,
        });
        let mut predictor = Self {
            place,
            known,
            correction: [1.0; 3],
            asked: Asked::All,
        };
        let found = predictor.contrast(here).counts;
        let sight = &predictor.known.target.here;
        predictor.correction =
            std::array::from_fn(|k| match sight.is_clipped(k) || !(found[k] > 0.0) {
                true => 1.0,
                false => (contrast[k] / found[k]).clamp(LEAST_CORRECTION, 1.0 / LEAST_CORRECTION),
            });
        predictor
    }

    /// From what was made of a picture before.
    pub(super) fn of_known(place: Place<'a>, known: Arc<Known>, correction: [f64; 3]) -> Self {
        Self {
            place,
            known,
            correction,
            asked: Asked::All,
        }
    }

    /// The same without what the vehicle saw earlier on its way.
    pub(super) fn without_earlier(self) -> Self {
        Self {
            asked: Asked::File,
            ..self
        }
    }

    /// What was made of the picture.
    pub(super) fn known(&self) -> (Arc<Known>, [f64; 3]) {
        (Arc::clone(&self.known), self.correction)
    }

    /// Contrast of a picture at the candidate as the published definition has it: the sensor's noise counts.
    pub fn contrast(&self, candidate: &Candidate) -> Contrast {
        self.at_distance(candidate.distance_m)
            .contrast(candidate.light_pct)
    }

    /// Contrast and its standard error as the sights alone have it, 8-bit counts; `None` for channels that none tells.
    pub(super) fn of_sights(&self, candidate: &Candidate) -> [Option<(f64, f64)>; 3] {
        let there = self.at_distance(candidate.distance_m);
        let seen = self.place.seen(&there.lit, candidate.light_pct);
        [0, 1, 2].map(|k| {
            let left = |frequency: f64| seen.left_of(k, frequency);
            let target = &self.known.target;
            let look = target.look_of_sights(k, candidate.distance_m, &left)?;
            Some(self.with_error(k, candidate.distance_m, &seen, &look))
        })
    }

    /// The view from a distance at a lamp level.
    pub(super) fn seen(&self, distance_m: f64, light_pct: f64) -> Seen<'_> {
        self.place
            .seen(&self.known.column.lit(distance_m), light_pct)
    }

    /// A picture taken at `here` in blocks.
    pub(super) fn blocks(&self, picture: &LinearPicture, here: &Candidate) -> Blocks {
        let seen = self.seen(here.distance_m, here.light_pct);
        Blocks::new(picture, &seen, self.place.exposure)
    }

    /// Channels whose mean tells nothing of the target.
    pub(super) fn without_mean(&self) -> [bool; 3] {
        self.known.target.without_mean()
    }

    /// Patch-to-patch spread of the target's reflectance over its mean.
    pub(super) fn spread(&self) -> [f64; 3] {
        self.known.target.spread()
    }

    /// Predictions from a distance, for many lamp levels.
    pub(super) fn at_distance(&self, distance_m: f64) -> AtDistance<'_> {
        AtDistance {
            predictor: self,
            distance_m,
            lit: self.known.column.lit(distance_m),
        }
    }

    /// Per channel why nothing can be said of the target, if so: its light is not that of the tables, or neither the picture nor
    /// a sight tells its detail.
    pub fn unknown(&self) -> [Option<Unknown>; 3] {
        self.known.target.unknown()
    }

    /// Which channels have more than 1 % of their pixels at full scale and tell the target's detail nevertheless: what these pixels would show
    /// is taken from the others.
    pub fn partly_clipped(&self) -> [bool; 3] {
        self.known.target.partly_clipped()
    }

    /// Mean reflectance of the target per channel, as the picture and the tables have it.
    pub fn reflectance(&self) -> [f64; 3] {
        self.known.target.reflectance()
    }

    /// Measured over predicted contrast here.
    pub fn correction(&self) -> [f64; 3] {
        self.correction
    }

    /// Contrast of a channel and its standard error, 8-bit counts.
    fn with_error(&self, k: usize, distance_m: f64, seen: &Seen, look: &Look) -> (f64, f64) {
        let whole = self.over_patches(k, seen, look, look.deviation, false);
        let of_water = self.place.doubt.as_ref().map_or(0.0, |doubt| {
            let lamps = [self.known.lamps[k], seen.lamps[k]];
            doubt.relative(k, distance_m - look.from_m, lamps)
        });
        // What noise hides may as well be there, the same in all patches.
        let raised = self.over_patches(k, seen, look, look.raised(of_water), true);
        let of_detail = (raised - whole).abs();
        let of_model = MODEL_ERROR * whole;
        (whole, of_detail.hypot(of_model).hypot(ROUNDING_COUNTS))
    }

    /// Mean over patches of the deviation of the stored count, where the target's is `deviation`; that of patches which noise hides is the
    /// same in all if `even`.
    fn over_patches(&self, k: usize, seen: &Seen, look: &Look, deviation: f64, even: bool) -> f64 {
        let exposure = self.place.exposure;
        let mean: [f64; PATCHES] =
            std::array::from_fn(|i| seen.veil[k][i] + seen.gain[k][i] * look.mean);
        let slope = slope_variance(&mean);
        let (shape, deviation) = (look.shape, deviation * self.correction[k]);
        let mut sum = 0.0;
        for i in 0..PATCHES {
            let of_patch = match even && look.is_hidden {
                true => 1.0,
                false => shape.deviations[i],
            };
            let gain = exposure * seen.gain[k][i];
            let signal = exposure * mean[i] + gain * look.mean * (shape.means[i] - 1.0);
            let own = gain * deviation * of_patch;
            let spread = (own * own + exposure.powi(2) * slope[i]).sqrt();
            sum += self.counted(signal, spread, &shape.quantiles[i]);
        }
        sum / PATCHES as f64
    }

    /// Deviation of the stored count in a patch of a mean signal and deviation.
    fn counted(&self, signal: f64, deviation: f64, quantiles: &Quantiles) -> f64 {
        let (mut mean, mut square, mut noise) = (0.0, 0.0, 0.0);
        for (z, share) in quantiles.with_shares() {
            let (count, variance) = self
                .place
                .response
                .at((signal + deviation * z).max(0.0) as f32);
            let (count, variance) = (f64::from(count), f64::from(variance));
            mean += share * count;
            square += share * count * count;
            noise += share * variance;
        }
        (square - mean.powi(2) + noise).max(0.0).sqrt()
    }
}

/// Predictions from one distance.
#[derive(Debug)]
pub(super) struct AtDistance<'a> {
    predictor: &'a Predictor<'a>,
    distance_m: f64,
    lit: Lit<'a>,
}

impl AtDistance<'_> {
    /// Contrast at a lamp level with its standard error.
    fn contrast(&self, light_pct: f64) -> Contrast {
        let mut found = Contrast {
            counts: [0.0; 3],
            error_counts: [0.0; 3],
        };
        self.each(light_pct, &mut |k, seen, look| {
            (found.counts[k], found.error_counts[k]) =
                self.predictor.with_error(k, self.distance_m, seen, look);
        });
        found
    }

    /// The contrast alone, 8-bit counts.
    pub(super) fn counts(&self, light_pct: f64) -> [f64; 3] {
        let mut counts = [0.0; 3];
        self.each(light_pct, &mut |k, seen, look| {
            counts[k] = self
                .predictor
                .over_patches(k, seen, look, look.deviation, false);
        });
        counts
    }

    fn each(&self, light_pct: f64, of: &mut dyn FnMut(usize, &Seen, &Look)) {
        let predictor = self.predictor;
        let seen = predictor.place.seen(&self.lit, light_pct);
        for k in 0..3 {
            let left = |frequency: f64| seen.left_of(k, frequency);
            let target = &predictor.known.target;
            let look = target.look(predictor.asked, k, self.distance_m, &left);
            of(k, &seen, &look);
        }
    }
}
