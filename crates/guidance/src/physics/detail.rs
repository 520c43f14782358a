//! The detail of a target by scale, from a picture.
//!
//! Variance inside windows of growing size adds up scale by scale (analysis of variance): the variance inside windows of 2w less that
//! inside windows of w is what lies between the two scales, of which contrast, the deviation inside patches, is the sum. So what
//! a picture at another distance shows inside its patches follows from the same windows at another size.

use std::sync::OnceLock;

use serde::{Deserialize, Serialize};
use uw_calib::response::CountResponse;

use super::cleared::{Cleared, LinearPicture, Sums, clear};
use super::grid::{self, PATCHES};
use super::light::Seen;
use super::patches::Patches;
use super::scales::{Bands, FINER_OCTAVES, LEAST_LEFT, Scales};
use super::shape::{Shape, quantiles};
use super::water::WaterTables;

/// The wave that stands for what lies beyond the largest window, per side of it: the peak of a Haar wavelet.
const WAVES_BEYOND: f64 = 0.35;
/// Each part of a picture is so much narrower than the one before.
const CROP: f64 = 0.8;
/// Error of the logarithm of a deviation of which nothing is known.
pub(super) const UNKNOWN: f64 = 10.0;
/// Most parts.
const MOST_CROPS: i32 = 9;
/// Relative error of the variance that a sensor's noise is taken to have.
const NOISE_ERROR: f64 = 0.15;
/// What is open of the variance of an octave finer than a pixel, as a share of it.
const FINER_DOUBT: f64 = 0.3;
/// Error of the logarithm of a deviation from which on noise hides which patches have it.
const HIDDEN_ERROR: f64 = 0.5;
/// Error of the logarithm of a deviation over the root of the share of pixels at full scale: what these would show is roughly known.
const FULL_SCALE_ERROR: f64 = 0.3;
/// Largest windows, in patches.
const MOST_PATCHES: usize = 3;
/// What is open of a scale's variance for each unit by which the logarithm of what the water leaves of its waves' variance differs between
/// the picture and a prediction: which waves it consists of is known roughly.
const BLUR_DOUBT: f64 = 0.05;

/// Detail of one channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ChannelDetail {
    /// Mean reflectance.
    pub(super) mean: f64,
    /// Window sizes on the target, m, rising from a pixel.
    pub(super) windows_m: Vec<f64>,
    /// Variance of the reflectance between each window size and the next: one fewer.
    pub(super) variance: Vec<f64>,
    /// What noise leaves open of each of them.
    pub(super) doubt: Vec<f64>,
    /// Contrast that the water left of each scale in the picture; empty in files of earlier versions.
    #[serde(default)]
    pub(super) left: Vec<f64>,
    /// Side of a patch of the whole picture on the target, m.
    pub(super) patch_m: f64,
    /// Mean deviation inside windows over its root mean square, for the windows from the second on.
    pub(super) evenness: Vec<f64>,
    /// Standard error of the logarithm of the deviation inside patches, from noise.
    pub(super) error: f64,
    /// How values are spread.
    pub(super) shape: Shape,
    /// Share of pixels at full scale.
    pub(super) clipped: f64,
    /// The variance as sums of waves, once it has been asked for.
    #[serde(skip)]
    pub(super) bands: OnceLock<Bands>,
}

/// What a target looks like from a distance without water: one channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look<'a> {
    /// Mean reflectance.
    pub(super) mean: f64,
    /// Root mean square over patches of the deviation inside them.
    pub(super) deviation: f64,
    /// Standard error of its logarithm.
    pub(super) error: f64,
    /// Distance of the pictures that tell, m.
    pub(super) from_m: f64,
    /// Root of the variance that is open beside that of `deviation`, which may be 0.
    pub(super) open: f64,
    /// How both are spread.
    pub(super) shape: &'a Shape,
    /// Whether noise hides how the detail is spread.
    pub(super) is_hidden: bool,
}

impl<'a> Look<'a> {
    /// With an error of the logarithm besides its own.
    pub(super) fn with_error(self, other: f64) -> Self {
        Self {
            error: self.error.hypot(other),
            ..self
        }
    }

    /// Less sure by as much as another deviation, of whose logarithm the error is `error`, contradicts it.
    pub(super) fn doubted_by(self, deviation: f64, error: f64) -> Self {
        if !(self.deviation > 0.0 && deviation > 0.0) {
            return self;
        }
        let apart = (deviation / self.deviation).ln();
        let beyond = apart * apart - self.error * self.error - error * error;
        self.with_error(beyond.max(0.0).sqrt())
    }

    /// The deviation a standard error above, `of_water` being the share of it that the water leaves open.
    pub(super) fn raised(&self, of_water: f64) -> f64 {
        let by_share = self.deviation * (1.0 + self.error.hypot(of_water).min(1.0));
        by_share.max(self.deviation.hypot(self.open))
    }

    /// Between this and another one. Half-way between them a quarter of what they differ by is open.
    pub(super) fn towards(&self, other: &Self, share: f64) -> Self {
        let between = |a: f64, b: f64| grid::between(a, b, share);
        let differ = match self.deviation > 0.0 && other.deviation > 0.0 {
            true => (self.deviation / other.deviation).ln(),
            false => 0.0,
        };
        Self {
            mean: between(self.mean, other.mean),
            deviation: between(self.deviation, other.deviation),
            error: between(self.error, other.error).hypot(share * (1.0 - share) * differ),
            from_m: between(self.from_m, other.from_m),
            open: between(self.open, other.open),
            shape: match share < 0.5 {
                true => self.shape,
                false => other.shape,
            },
            is_hidden: self.is_hidden || other.is_hidden,
        }
    }
}

/// What a picture tells of the target before it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetDetail {
    /// Focal length, pixels.
    pub(super) focal_px: f64,
    /// Per channel that of the whole picture and of smaller and smaller parts around its middle, which are what nearer pictures
    /// show: each part is [`CROP`] as wide as the one before.
    pub(super) channels: [Vec<ChannelDetail>; 3],
}

impl ChannelDetail {
    /// Whether all lists are as long as they must be and all numbers ones.
    fn is_right(&self) -> bool {
        let n = self.windows_m.len();
        let lists = [&self.variance, &self.doubt, &self.evenness];
        let finite = |list: &&Vec<f64>| list.iter().all(|v| v.is_finite());
        n > MOST_PATCHES
            && self.windows_m[0] > 0.0
            && self.windows_m.windows(2).all(|pair| pair[0] < pair[1])
            && lists.iter().all(|list| list.len() + 1 == n)
            && (self.left.is_empty() || self.left.len() + 1 == n)
            && self.left.iter().all(|left| *left > 0.0 && left.is_finite())
            && self.shape.is_right()
            && lists.iter().all(finite)
            && [self.mean, self.patch_m, self.error, self.clipped]
                .iter()
                .all(|v| v.is_finite())
    }

    /// How the target, of which a picture from `from_m` tells, looks from `distance_m` through a camera of `focal_px`, where `left` is the contrast left of waves of a
    /// frequency, 1/m.
    pub(super) fn look(
        &self,
        [from_m, distance_m]: [f64; 2],
        focal_px: f64,
        left: &dyn Fn(f64) -> f64,
    ) -> Look<'_> {
        let windows = &self.windows_m;
        let ratio = distance_m / (windows[0] * focal_px);
        // Pixels and patches grow with the distance.
        let (pixel, patch) = (windows[0] * ratio, self.patch_m * ratio);
        let share = |from: f64, to: f64| {
            let (low, high) = (from.max(pixel), to.min(patch));
            match high > low {
                true => (high / low).ln() / (to / from).ln(),
                false => 0.0,
            }
        };
        let bands = self.bands();
        let left_of = bands.left(left);
        let (finer_left, own_left) = left_of.split_at(FINER_OCTAVES);
        let (mut sum, mut doubt) = (0.0, 0.0);
        for (i, pair) in windows.windows(2).enumerate() {
            let counts = share(pair[0], pair[1]) * own_left[i];
            let of_blur = self.blur_doubt(i, own_left[i].sqrt());
            sum += counts * self.variance[i];
            doubt += counts * (self.doubt[i] + of_blur * self.variance[i]);
        }
        // Finer than a pixel of the picture, octave by octave.
        let of_blur = self.blur_doubt(0, own_left[0].sqrt());
        let mut open = self.doubt[0] + of_blur * self.variance[0];
        for i in (0..FINER_OCTAVES).rev() {
            let finer = bands.variance[i];
            open += FINER_DOUBT * finer;
            let counts = share(bands.windows_m[i], bands.windows_m[i + 1]) * finer_left[i];
            sum += counts * finer;
            doubt += counts * open;
        }
        // Beyond the largest window: as much an octave as in the last.
        if let (Some(&[a, b]), Some(last)) = (windows.last_chunk(), self.variance.last())
            && patch > b
        {
            let beyond =
                (patch / b.max(pixel)).ln() / (b / a).ln() * last * left(WAVES_BEYOND / b).powi(2);
            sum += beyond;
            doubt += beyond;
        }
        let even = self.evenness_at(patch) / self.evenness_at(self.own_patch_m());
        Look {
            mean: self.mean,
            deviation: sum.sqrt() * even,
            from_m,
            open: doubt.sqrt() * even,
            error: match sum > 0.0 {
                true => (0.5 * doubt / sum).min(UNKNOWN),
                false => UNKNOWN,
            },
            shape: &self.shape,
            is_hidden: self.error > HIDDEN_ERROR,
        }
    }

    /// Its variance as sums of waves, made once.
    fn bands(&self) -> &Bands {
        self.bands
            .get_or_init(|| Bands::new(&self.windows_m, &self.variance))
    }

    /// What is open of a scale's variance, as a share of it, where a prediction has `there` left of its contrast.
    fn blur_doubt(&self, scale: usize, there: f64) -> f64 {
        let Some(&here) = self.left.get(scale) else {
            return 0.0;
        };
        2.0 * BLUR_DOUBT * (there.max(LEAST_LEFT) / here).ln().abs()
    }

    /// Side of the part's own patches, of which the shape is, m.
    pub(super) fn own_patch_m(&self) -> f64 {
        self.windows_m[self.windows_m.len() - MOST_PATCHES]
    }

    fn evenness_at(&self, window_m: f64) -> f64 {
        let windows = &self.windows_m[1..];
        let after = windows.partition_point(|w| *w < window_m);
        match (after.checked_sub(1), windows.get(after)) {
            (Some(before), Some(to)) => {
                let from = windows[before];
                let share = (window_m / from).ln() / (to / from).ln();
                let (a, b) = (self.evenness[before], self.evenness[after]);
                a + share * (b - a)
            }
            (None, _) => self.evenness.first().copied().unwrap_or(1.0),
            (_, None) => self.evenness.last().copied().unwrap_or(1.0),
        }
    }
}

impl TargetDetail {
    /// What is wrong with a detail from a file.
    pub(super) fn check(&self) -> Result<(), String> {
        if !(self.focal_px > 0.0 && self.focal_px.is_finite()) {
            return Err(format!(
                "detail.focal_px must be finite and > 0, got {}",
                self.focal_px
            ));
        }
        for (k, parts) in self.channels.iter().enumerate() {
            let wrong = parts.iter().position(|part| !part.is_right());
            match wrong {
                None if !parts.is_empty() => {}
                None => return Err(format!("detail.channels[{k}] must not be empty")),
                Some(i) => {
                    return Err(format!(
                        "detail.channels[{k}][{i}] must have rising windows, as many variances, and {PATCHES} patches"
                    ));
                }
            }
        }
        Ok(())
    }

    /// Of a `picture` taken from `distance_m`, which is what `seen` says times `exposure`.
    pub(super) fn new(
        picture: &LinearPicture,
        tables: &WaterTables,
        seen: &Seen,
        (exposure, distance_m): (f64, f64),
        response: &CountResponse,
    ) -> Self {
        let focal_px = 0.5 * picture.width as f64 / tables.half_view[0];
        let metres_per_px = distance_m / focal_px;
        Self {
            focal_px,
            channels: std::array::from_fn(|k| {
                let mut cleared = clear(picture, seen, exposure, k, response);
                // What finer scales are expected to hold was chosen in daylight with the mean noise: with that of each place turbid water is
                // predicted worse (seabed 0.046 instead of 0.037 of 15 counts), in the dark much better.
                if !tables.depths_m.is_empty() {
                    cleared.noise = cleared.noise.averaged();
                }
                let left = |frequency: f64| seen.left_of(k, frequency);
                let patch_px = ((picture.width / 10 * (picture.height / 6)) as f64).sqrt();
                let scale = (metres_per_px, patch_px * metres_per_px);
                let part = |i: i32| cleared.middle(CROP.powi(i));
                let parts = (0..MOST_CROPS).map_while(part);
                parts.map(|part| channel(&part, scale, &left)).collect()
            }),
        }
    }
}

fn channel(
    cleared: &Cleared,
    (metres_per_px, patch_m): (f64, f64),
    left: &dyn Fn(f64) -> f64,
) -> ChannelDetail {
    let (patch_w, patch_h) = (cleared.width / 10, cleared.height / 6);
    let patch_px = ((patch_w * patch_h) as f64).sqrt();
    let mut windows = vec![];
    let mut side = 2;
    while (side as f64) < 0.7 * patch_px {
        windows.push((side, side));
        side *= 2;
    }
    windows.extend((1..=MOST_PATCHES).map(|n| (n * patch_w, n * patch_h)));
    let sums = Sums::new(cleared);
    let patches = Patches::new(&sums, (patch_w, patch_h), &cleared.noise);
    let noise = cleared.noise.before(patches.detail());
    let patches = Patches::new(&sums, (patch_w, patch_h), &noise);
    let mut windows_m = vec![metres_per_px];
    let (mut scales, mut evenness) = (Scales::default(), Vec::new());
    let (mean_noise, unevenness) = (noise.mean(), noise.unevenness());
    let pixels = cleared.values.len() as f64;
    let mut before = 0.0;
    let mut from_px = 1.0;
    for (w, h) in windows {
        let (inside, even) = sums.inside(w, h, &noise);
        evenness.push(even);
        scales.variance.push(inside - before);
        let of_noise = mean_noise.of(from_px * from_px) - mean_noise.of((w * h) as f64);
        // How well the noise is known, and what it happens to be in so many windows.
        let happens = unevenness * (2.0 * from_px * from_px / pixels).sqrt();
        scales.doubt.push(NOISE_ERROR.hypot(happens) * of_noise);
        before = inside;
        from_px = ((w * h) as f64).sqrt();
        windows_m.push(from_px * metres_per_px);
    }
    scales.clear(&windows_m, left);
    scales.expect(&windows_m);
    let of_full_scale = FULL_SCALE_ERROR * cleared.clipped().sqrt();
    scales.doubt_share(2.0 * of_full_scale);
    let (mean, detail) = (patches.mean(), patches.detail());
    ChannelDetail {
        mean,
        windows_m,
        variance: scales.variance,
        doubt: scales.doubt,
        left: scales.left,
        patch_m,
        evenness,
        error: match detail > 0.0 {
            true => (0.5 * NOISE_ERROR * mean_noise.of_pixel / detail)
                .hypot(of_full_scale)
                .min(UNKNOWN),
            false => UNKNOWN,
        },
        shape: Shape {
            means: patches.means(mean),
            deviations: patches.deviations(),
            quantiles: quantiles(cleared, (patch_w, patch_h)),
        },
        clipped: cleared.clipped(),
        bands: OnceLock::new(),
    }
}

#[cfg(test)]
mod tests;
