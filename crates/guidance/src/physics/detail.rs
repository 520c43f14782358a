//! The detail of a target by scale, from a picture.
//!
//! Variance inside windows of growing size adds up scale by scale (analysis of variance): the variance inside windows of 2w less that
//! inside windows of w is what lies between the two scales, of which contrast, the deviation inside patches, is the sum. So what
//! a picture at another distance shows inside its patches follows from the same windows at another size.

use serde::{Deserialize, Serialize};
use uw_calib::response::CountResponse;
use uw_calib::stats::{PATCH_COLUMNS, PATCH_ROWS};

use super::cleared::{Cleared, LinearPicture, QUANTILES, Sums, clear, quantiles};
use super::grid::{self, PATCHES};
use super::light::Seen;
use super::water::WaterTables;

/// Waves that stand for what lies between a window and the next, per side of the smaller one: the peak of a Haar wavelet.
const WAVES_PER_WINDOW: f64 = 0.35;
/// Least and most of what the finest octave in sight is taken to hold of the one above it.
const FINER: [f64; 2] = [0.2, 1.0];
/// What an octave finer than a pixel holds of the one above it, over what the finest in sight does: things are smooth at last. With 1
/// contrast from six times nearer comes out 22 % too high in pictures of 320 pixels, in air, with this 10 %; of 1280 pixels 2 and 1 %
/// (`tools/nearer_contrast.py`).
const SMOOTHING: f64 = 0.8;
/// Each part of a picture is so much narrower than the one before.
pub(super) const CROP: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Error of the logarithm of a deviation of which nothing is known.
pub(super) const UNKNOWN: f64 = 10.0;
/// Largest deviation of a patch over their root mean square.
const MOST_UNEVEN: f64 = 4.0;
/// Most parts.
const MOST_CROPS: i32 = 6;
/// Relative error of the variance that a sensor's noise is taken to have.
const NOISE_ERROR: f64 = 0.15;
/// What is open of the variance of an octave finer than a pixel, as a share of it.
const FINER_DOUBT: f64 = 0.3;
/// Least contrast left of a scale that is undone.
const LEAST_LEFT: f64 = 0.02;
/// Standard errors from 0 beyond which a variance is none, or is what was measured.
const FAR_FROM_NONE: f64 = 6.0;
/// Least square of a quarter's deviation over that of the picture, and mean over the picture's: less is not told from none.
const LEAST_QUARTER: f64 = 0.01;
/// Largest windows, in patches.
const MOST_PATCHES: usize = 3;
/// What a scale is expected to hold of the variance of the next coarser one, octave for octave, before the picture is asked: natural
/// scenes have nearly as much in each octave (Field 1987, J. Opt. Soc. Am. A 4, 2379).
const EXPECTED_FALL: f64 = 0.85;
/// How well that is expected, as a share of it.
const EXPECTED_DOUBT: f64 = 0.5;
/// What is open of a scale's variance for each unit by which the logarithm of what the water leaves of its waves' variance differs between
/// the picture and a prediction: one wave stands for a whole scale.
const BLUR_DOUBT: f64 = 0.2;

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
}

impl<'a> Look<'a> {
    /// The deviation a standard error above, `of_water` being the share of it that the water leaves open.
    pub(super) fn raised(&self, of_water: f64) -> f64 {
        let by_share = self.deviation * (1.0 + self.error.hypot(of_water).min(1.0));
        by_share.max(self.deviation.hypot(self.open))
    }

    /// Between this and another one.
    pub(super) fn towards(&self, other: &Self, share: f64) -> Self {
        let between = |a: f64, b: f64| grid::between(a, b, share);
        Self {
            mean: between(self.mean, other.mean),
            deviation: between(self.deviation, other.deviation),
            error: between(self.error, other.error),
            from_m: between(self.from_m, other.from_m),
            open: between(self.open, other.open),
            shape: match share < 0.5 {
                true => self.shape,
                false => other.shape,
            },
        }
    }
}

/// How a target's values are spread over patches and in them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shape {
    /// Per patch the mean over that of the picture.
    pub(super) means: Vec<f64>,
    /// Per patch the deviation over their root mean square.
    pub(super) deviations: Vec<f64>,
    /// Deviations from a patch's mean over its deviation, mean 0, mean square 1.
    pub(super) quantiles: [f64; QUANTILES],
}

impl Shape {
    /// Standard deviation of the patches' means over that of the picture.
    pub(super) fn spread(&self) -> f64 {
        spread(&self.means)
    }

    /// Whether no patch shows more than noise, so that nothing tells how the detail is spread.
    pub(super) fn is_hidden(&self) -> bool {
        self.deviations.iter().all(|deviation| *deviation == 0.0)
    }

    /// Standard deviation of the patches' deviations over their mean.
    pub(super) fn unevenness(&self) -> f64 {
        spread(&self.deviations)
    }

    /// How much the quarters of the picture differ: the standard deviation of the logarithm of their contrast, as counts have it.
    pub(super) fn unlikeness(&self) -> f64 {
        let quarter = |q: usize| {
            let (columns, rows) = (PATCH_COLUMNS / 2, PATCH_ROWS / 2);
            let (mut square, mut mean) = (0.0, 0.0);
            for i in 0..columns * rows {
                let row = q / 2 * rows + i / columns;
                let patch = row * PATCH_COLUMNS + q % 2 * columns + i % columns;
                square += self.deviations[patch].powi(2);
                mean += self.means[patch];
            }
            let n = (columns * rows) as f64;
            (square / n).max(LEAST_QUARTER).sqrt().ln() - 0.5 * (mean / n).max(LEAST_QUARTER).ln()
        };
        let all = [0, 1, 2, 3].map(quarter);
        let mean = all.iter().sum::<f64>() / 4.0;
        (all.iter().map(|q| (q - mean).powi(2)).sum::<f64>() / 3.0).sqrt()
    }
}

/// Standard deviation over the mean; 0 of nothing.
fn spread(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = |value: &f64| (value - mean).powi(2);
    let deviation = (values.iter().map(square).sum::<f64>() / n).sqrt();
    match mean > 0.0 {
        true => deviation / mean,
        false => 0.0,
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
        let shape = [&self.shape.means, &self.shape.deviations];
        let finite = |list: &&Vec<f64>| list.iter().all(|v| v.is_finite());
        n > MOST_PATCHES
            && self.windows_m[0] > 0.0
            && self.windows_m.windows(2).all(|pair| pair[0] < pair[1])
            && lists.iter().all(|list| list.len() + 1 == n)
            && (self.left.is_empty() || self.left.len() + 1 == n)
            && self.left.iter().all(|left| *left > 0.0 && left.is_finite())
            && shape.iter().all(|list| list.len() == PATCHES)
            && lists.iter().chain(&shape).all(finite)
            && [self.mean, self.patch_m, self.error, self.clipped]
                .iter()
                .all(|v| v.is_finite())
            && self.shape.quantiles.iter().all(|v| v.is_finite())
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
        let left_of = |from: f64| left(WAVES_PER_WINDOW / from).abs();
        let counted = |from: f64, to: f64| share(from, to) * left_of(from).powi(2);
        let (mut sum, mut doubt) = (0.0, 0.0);
        for (i, pair) in windows.windows(2).enumerate() {
            let counts = counted(pair[0], pair[1]);
            let of_blur = self.blur_doubt(i, left_of(pair[0]));
            sum += counts * self.variance[i];
            doubt += counts * (self.doubt[i] + of_blur * self.variance[i]);
        }
        // Finer than a pixel of the picture, octave by octave.
        let [least, most] = FINER;
        let falling = match self.variance.as_slice() {
            [finest, next, ..] if *next > 0.0 => (finest / next).clamp(least, most),
            _ => least,
        };
        let of_blur = self.blur_doubt(0, left_of(windows[0]));
        let (mut finer, mut open) = (self.variance[0], self.doubt[0] + of_blur * self.variance[0]);
        let mut to = windows[0];
        while to > pixel {
            finer *= SMOOTHING * falling;
            open += FINER_DOUBT * finer;
            let counts = counted(0.5 * to, to);
            sum += counts * finer;
            doubt += counts * open;
            to *= 0.5;
        }
        // Beyond the largest window: as much an octave as in the last.
        if let (Some(&[a, b]), Some(last)) = (windows.last_chunk(), self.variance.last())
            && patch > b
        {
            let beyond = (patch / b.max(pixel)).ln() / (b / a).ln() * last * left_of(b).powi(2);
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
        }
    }

    /// What is open of a scale's variance, as a share of it, where a prediction has `there` left of its contrast.
    fn blur_doubt(&self, scale: usize, there: f64) -> f64 {
        let Some(&here) = self.left.get(scale) else {
            return 0.0;
        };
        2.0 * BLUR_DOUBT * (there.max(LEAST_LEFT) / here).ln().abs()
    }

    /// Side of the patches that the shape is of, m.
    fn own_patch_m(&self) -> f64 {
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
                let cleared = clear(picture, seen, exposure, k, response);
                let transfer = |window_px: f64| {
                    seen.left_of(k, WAVES_PER_WINDOW / (window_px * metres_per_px))
                };
                let patch_px = ((picture.width / 10 * (picture.height / 6)) as f64).sqrt();
                let scale = (metres_per_px, patch_px * metres_per_px);
                let part = |i: i32| cleared.middle(CROP.powi(i));
                let parts = (0..MOST_CROPS).map_while(part);
                parts.map(|part| channel(&part, scale, &transfer)).collect()
            }),
        }
    }
}

/// What a picture shows scale by scale, from fine to coarse.
#[derive(Default)]
struct Scales {
    variance: Vec<f64>,
    doubt: Vec<f64>,
    left: Vec<f64>,
}

impl Scales {
    /// Where noise hides a scale it is taken to be like the next coarser one, as far as the picture does not contradict: the mean of
    /// both, weighted by how well they are known.
    fn expect(&mut self, windows_m: &[f64]) {
        let octaves: Vec<f64> = windows_m
            .windows(2)
            .map(|pair| (pair[1] / pair[0]).log2())
            .collect();
        for i in (0..self.variance.len().saturating_sub(1)).rev() {
            let coarser = positive(self.variance[i + 1], self.doubt[i + 1]) / octaves[i + 1];
            let expected = EXPECTED_FALL * coarser * octaves[i];
            let (of_expected, of_measured) = (
                (EXPECTED_DOUBT * (expected + self.doubt[i + 1])).powi(2)
                    + self.doubt[i + 1].powi(2),
                self.doubt[i].powi(2),
            );
            if !(of_expected > 0.0) {
                continue;
            }
            let trust = of_expected / (of_expected + of_measured);
            self.variance[i] = expected + trust * (self.variance[i] - expected);
            self.doubt[i] *= trust.sqrt();
        }
        for (variance, doubt) in self.variance.iter_mut().zip(&self.doubt) {
            *variance = positive(*variance, *doubt);
        }
    }
}

/// Mean of what is not below 0 and was measured as `value` with a normal `error`: a variance that noise has brought to 0 or below need not
/// be none.
fn positive(value: f64, error: f64) -> f64 {
    let z = value / error;
    if !(error > 0.0) || z > FAR_FROM_NONE {
        return value.max(0.0);
    }
    // Below that the ratio of density to tail goes as -z - 1/z.
    let z = z.max(-FAR_FROM_NONE);
    let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    let above = 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
    error * (z + density / above)
}

fn channel(
    cleared: &Cleared,
    (metres_per_px, patch_m): (f64, f64),
    transfer: &dyn Fn(f64) -> f64,
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
    let mut windows_m = vec![metres_per_px];
    let (mut scales, mut evenness) = (Scales::default(), Vec::new());
    let mut before = 0.0;
    let mut from_px = 1.0;
    for (w, h) in windows {
        let (inside, even) = sums.inside(w, h, cleared.noise);
        evenness.push(even);
        let left = transfer(from_px).max(LEAST_LEFT);
        scales.variance.push((inside - before) / (left * left));
        let of_noise = cleared.noise * (1.0 / (from_px * from_px) - 1.0 / (w * h) as f64);
        // How well the noise is known, and what it happens to be in so many windows.
        let happens = (2.0 * from_px * from_px / cleared.values.len() as f64).sqrt();
        let open = NOISE_ERROR.hypot(happens) * of_noise;
        scales.doubt.push(open / (left * left));
        scales.left.push(left);
        before = inside;
        from_px = ((w * h) as f64).sqrt();
        windows_m.push(from_px * metres_per_px);
    }
    scales.expect(&windows_m);
    let n = cleared.values.len() as f64;
    let mean = cleared.values.iter().sum::<f64>() / n;
    // Small parts have room for another column or row.
    let patches: Vec<(f64, f64)> = sums
        .window_grid([PATCH_COLUMNS, PATCH_ROWS], patch_w, patch_h)
        .collect();
    let own = patches.iter().map(|(_, variance)| variance).sum::<f64>() / PATCHES as f64;
    let detail = own - cleared.noise;
    let positive = |patch: &(f64, f64)| (patch.1 - cleared.noise).max(0.0);
    let of_all = patches.iter().map(positive).sum::<f64>() / PATCHES as f64;
    let of_patch = |patch: &(f64, f64)| {
        (positive(patch) / of_all.max(f64::MIN_POSITIVE))
            .sqrt()
            .min(MOST_UNEVEN)
    };
    ChannelDetail {
        mean,
        windows_m,
        variance: scales.variance,
        doubt: scales.doubt,
        left: scales.left,
        patch_m,
        evenness,
        error: match detail > 0.0 {
            true => (0.5 * NOISE_ERROR * cleared.noise / detail).min(UNKNOWN),
            false => UNKNOWN,
        },
        shape: Shape {
            means: patches.iter().map(|patch| patch.0 / mean).collect(),
            deviations: patches.iter().map(of_patch).collect(),
            quantiles: quantiles(cleared, (patch_w, patch_h)),
        },
        clipped: cleared.clipped,
    }
}

#[cfg(test)]
mod tests;
