//! Contrast without the sensor's noise, the floor below which it says nothing, and clipped pixels.
//!
//! The published contrast ([`crate::stats`]) counts noise as detail. Here the variance d = s² - v is what is left of a patch's
//! variance s² without the noise's v ([`crate::noise`]), and the contrast is the mean of its root over the patches: the contrast of
//! the picture that the sensor stores on average. (Where noise is clipped in the dark that average is flatter than the light.)
//!
//! **The root near zero.** d scatters about what is true by its standard error τ, and is below 0 for half of all patches without
//! detail. max(d, 0)^½ makes 0.41 τ^½ of them; for scale, that is 0.25 counts of 5.6 counts of noise in patches of 128 × 120 pixels
//! and 0.57 in those of 24 × 22. No function of d has the root of what is true as its mean (the root has no slope at 0), but
//!
//! ```text
//! r(d) = τ^½ (x + 1.5 exp(-x))^½ for d >= 0,  -0.8 of that for d < 0,  x = |d| / τ
//! ```
//!
//! is off by at most 0.14 τ^½, to either side, instead of 0.41 (least worst bias among functions of this kind); beyond d = 4 τ it is
//! the root within 0.01 τ^½. So a contrast near the floor may come out a little below 0. It is not cut off there, which would bring the bias back.
//!
//! **The floor** is what noise alone makes: the mean of r without detail and three standard errors of the mean over the
//! patches. A contrast below it cannot be told from none; noise alone exceeds it in about one of 700 pictures. It is
//! at least the deviation of rounding, 0.29 steps: where noise does not reach from step to step, rounding makes up to as much of an even
//! picture. Errors of the stated noise of a known sensor are not in it.

use crate::even::Even;
use crate::noise::{self, Estimated, NoiseModel, NoiseSource, Tiles};
use crate::photo::Resampling;
use crate::planes::{Part, Planes};
use crate::stats::{self, PATCH_COLUMNS, PATCH_ROWS, PatchGrid, PatchStats};

/// Share of pixels at full scale above which a picture's numbers are doubtful.
pub const MAX_SATURATED: f64 = 0.01;

/// What [`root`] adds under the root, and what it takes of it below 0.
const LIFT: f64 = 1.5;
const BELOW: f64 = 0.8;
/// Of a standard normal variable: mean and standard deviation of [`root`], and its covariance with it, for τ = 1.
const ROOT_MEAN: f64 = 0.1255;
const ROOT_DEVIATION: f64 = 1.132;
const ROOT_SLOPE: f64 = 0.950;
/// Standard errors from the mean of noise alone to the floor.
const FLOOR_ERRORS: f64 = 3.0;
/// Standard deviation of rounding in steps, 1/sqrt(12).
const ROUNDING: f64 = 0.289;
/// Least and most of fourth moment over squared variance, less 1: those of normal noise, and of what few pixels make.
const SPREADS: [f64; 2] = [2.0, 10.0];

/// What of a picture is detail, what noise and what clipped, per channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detail {
    /// Contrast without the noise, 8-bit counts; near 0 it may be a little below.
    pub contrast: [f64; 3],
    /// What noise alone stays below, 8-bit counts, >= 0.
    pub floor: [f64; 3],
    /// Root of the mean variance of the noise over the patches, 8-bit counts.
    pub noise: [f64; 3],
    /// Where the noise is taken from.
    pub source: NoiseSource,
    /// Share of all known pixels that are 0, in [0, 1].
    pub black: [f64; 3],
    /// Share of all known pixels at full scale, in [0, 1].
    pub saturated: [f64; 3],
}

/// The picture as it was stored, of one that was made of it.
pub(crate) struct Behind<'a> {
    /// The lens and the exposure that were taken out.
    pub(crate) even: Option<&'a Even>,
    /// Its pixels; the mean of the frames.
    pub(crate) stored: &'a Planes,
    /// The way that it was resampled by.
    pub(crate) resampling: Option<&'a Resampling>,
    /// How many frames it is the mean of.
    pub(crate) frames: f64,
}

/// What became of the noise of a patch.
struct Grown {
    /// Mean count of the patch as it was stored.
    mean: f64,
    /// By how much the variance of small differences about it has grown.
    signal: f64,
    /// The same of the noise of stored pixels, which resampling lessens.
    noise: f64,
}

impl Behind<'_> {
    /// Of a patch of this mean, which begins at the pixel `corner` and has `size` pixels.
    fn grown(&self, mean: f64, corner: [usize; 2], size: [usize; 2]) -> Grown {
        let middle = [0, 1].map(|k| corner[k] + size[k] / 2);
        let left = self
            .resampling
            .map_or(1.0, |map| map.noise_left(corner, size));
        let Some(even) = self.even else {
            return Grown {
                mean,
                signal: 1.0,
                noise: left,
            };
        };
        let at = |map: &Resampling| map.at(middle[0] as f64, middle[1] as f64);
        let place = match self.resampling.and_then(at) {
            Some(at) => at.map(|v| v.max(0.0) as usize),
            None => middle,
        };
        let of = [self.stored.width, self.stored.height];
        let inside = [0, 1].map(|k| place[k].min(of[k] - 1));
        let (mean, growth) = even.before(mean, even.share(inside, of));
        let signal = growth * growth;
        Grown {
            mean,
            signal,
            noise: left * signal,
        }
    }
}

impl Detail {
    /// Measures the picture of a grid, stored in steps of `step` counts. Of
    /// a picture that was made of another, `behind` is how that was stored. `None` where the noise is to be taken from the picture and patches are smaller
    /// than 3 × 3 pixels.
    pub(crate) fn measure(
        grid: &PatchGrid,
        planes: &Planes,
        step: f64,
        model: &NoiseModel,
        behind: Option<&Behind<'_>>,
    ) -> Option<Self> {
        let size = [grid.width / PATCH_COLUMNS, grid.height / PATCH_ROWS];
        let corners = stats::corners([grid.width, grid.height]);
        let tiles = Tiles {
            corners: &corners,
            width: size[0],
            height: size[1],
            stride: grid.width,
        };
        let mut detail = Self {
            contrast: [0.0; 3],
            floor: [0.0; 3],
            noise: [0.0; 3],
            source: model.source(),
            black: [0.0; 3],
            saturated: [0.0; 3],
        };
        for (k, plane) in planes.channels.iter().enumerate() {
            let whole = Part::whole(plane);
            let is = |value: f64, so: bool| {
                if value.is_nan() {
                    value
                } else {
                    f64::from(u8::from(so))
                }
            };
            detail.black[k] = whole.mean_of_known(|value| is(value, value <= 0.0));
            detail.saturated[k] = whole.mean_of_known(|value| is(value, value >= FULL_SCALE));
            let noise = noise_of(grid, k, &tiles, (plane, behind), step, model)?;
            let sums = channel(grid, k, plane, &noise);
            detail.contrast[k] = sums.contrast();
            detail.floor[k] = sums.floor().max(ROUNDING * step);
            detail.noise[k] = (sums.noise / sums.patches).max(0.0).sqrt();
        }
        Some(detail)
    }

    /// Which channels show no more than noise.
    pub fn at_floor(&self) -> [bool; 3] {
        std::array::from_fn(|k| self.contrast[k] <= self.floor[k])
    }

    /// Which channels have more than a share of their pixels at full scale.
    pub fn saturated_beyond(&self, share: f64) -> [bool; 3] {
        self.saturated.map(|s| s > share)
    }

    /// Which channels have less noise than is stated: their contrast is further below 0 than noise brings it.
    pub fn noise_overstated(&self) -> [bool; 3] {
        std::array::from_fn(|k| self.contrast[k] < -self.floor[k])
    }

    /// Which channels show no more than noise, for another reason than that their noise is overstated.
    pub fn without_detail(&self) -> [bool; 3] {
        let (at_floor, overstated) = (self.at_floor(), self.noise_overstated());
        std::array::from_fn(|k| at_floor[k] && !overstated[k])
    }

    /// What should be known of the picture, a sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let mut tell = |of: [bool; 3], what: &str| {
            if let Some(names) = channel_names(of) {
                warnings.push(format!("{names}: {what}"));
            }
        };
        tell(
            self.noise_overstated(),
            "the picture has less noise than is stated; check noise and encoding",
        );
        tell(
            self.without_detail(),
            "contrast is at the noise floor, no detail is told from noise; go nearer, light more or expose longer",
        );
        tell(
            self.saturated_beyond(MAX_SATURATED),
            "more than 1 % of the pixels are at full scale, contrast and mean are too small; expose less or dim the lamps",
        );
        warnings
    }
}

/// "R, B" of the channels that are marked; `None` where none is.
pub fn channel_names(of: [bool; 3]) -> Option<String> {
    let names: Vec<&str> = ["R", "G", "B"]
        .into_iter()
        .zip(of)
        .filter_map(|(name, marked)| marked.then_some(name))
        .collect();
    (!names.is_empty()).then(|| names.join(", "))
}

/// What counts as full scale, 8-bit counts: 255 but for the rounding of 16-bit values.
const FULL_SCALE: f64 = 255.0 - 1e-6;

/// Sums over the patches of a channel.
#[derive(Default)]
struct Sums {
    patches: f64,
    noise: f64,
    roots: f64,
    /// Roots of τ.
    scales: f64,
    /// Variance of the sum of roots by errors of each patch's own, under noise alone.
    own: f64,
    /// Its standard error by that of the noise, where that is taken from the picture.
    shared: f64,
}

impl Sums {
    fn contrast(&self) -> f64 {
        self.roots / self.patches
    }

    fn floor(&self) -> f64 {
        let error = (self.own + self.shared * self.shared).sqrt();
        (ROOT_MEAN * self.scales + FLOOR_ERRORS * error) / self.patches
    }
}

/// Noise of a channel: variance of each patch, squared counts, and the relative standard errors of that at a level and of all.
struct ChannelNoise {
    patches: Vec<f64>,
    of_level: f64,
    of_all: f64,
}

fn noise_of(
    grid: &PatchGrid,
    k: usize,
    tiles: &Tiles,
    (plane, behind): (&[f64], Option<&Behind<'_>>),
    step: f64,
    model: &NoiseModel,
) -> Option<ChannelNoise> {
    let grown = |(patch, &corner): (&PatchStats, &usize)| match behind {
        None => Grown {
            mean: patch.mean[k],
            signal: 1.0,
            noise: 1.0,
        },
        Some(behind) => {
            let corner = [corner % grid.width, corner / grid.width];
            behind.grown(patch.mean[k], corner, [tiles.width, tiles.height])
        }
    };
    let patches = grid.patches.iter().zip(tiles.corners);
    match model {
        NoiseModel::Picture => {
            let found = estimated(k, tiles, (plane, behind))?;
            let resampled = behind.is_some_and(|behind| behind.resampling.is_some());
            let of = |(i, patch): (usize, (&PatchStats, &usize))| {
                let grown = grown(patch);
                let own = found
                    .patches
                    .get(i)
                    .filter(|noise| !resampled && !noise.is_nan());
                let noise = own.copied().unwrap_or_else(|| found.at(grown.mean));
                noise * grown.noise
            };
            Some(ChannelNoise {
                patches: patches.enumerate().map(of).collect(),
                of_level: found.of_level,
                of_all: found.of_all,
            })
        }
        NoiseModel::Sensor(sensor) => {
            let frames = behind.map_or(1.0, |behind| behind.frames);
            let of = |patch: (&PatchStats, &usize)| {
                let grown = grown(patch);
                let total = patch.0.std[k] * patch.0.std[k] / grown.signal;
                grown.noise * sensor.of_patch(grown.mean, total, step) / frames
            };
            Some(ChannelNoise {
                patches: patches.map(of).collect(),
                of_level: 0.0,
                of_all: 0.0,
            })
        }
    }
}

/// Noise of the stored picture, by the patches of its own grid.
fn estimated(
    k: usize,
    tiles: &Tiles<'_>,
    (plane, behind): (&[f64], Option<&Behind<'_>>),
) -> Option<Estimated> {
    let Some(behind) = behind else {
        return noise::estimate(tiles, plane);
    };
    let stored = &behind.stored.channels[k];
    if behind.resampling.is_none() {
        return noise::estimate(tiles, stored);
    }
    let size = [behind.stored.width, behind.stored.height];
    let corners = stats::corners(size);
    let of_stored = Tiles {
        corners: &corners,
        width: size[0] / PATCH_COLUMNS,
        height: size[1] / PATCH_ROWS,
        stride: size[0],
    };
    noise::estimate(&of_stored, stored)
}

fn channel(grid: &PatchGrid, k: usize, plane: &[f64], found: &ChannelNoise) -> Sums {
    let size = [grid.width, grid.height];
    let mut sums = Sums::default();
    for (i, (patch, &noise)) in grid.patches.iter().zip(&found.patches).enumerate() {
        let (mean, total) = (patch.mean[k], patch.std[k] * patch.std[k]);
        if mean.is_nan() {
            continue;
        }
        let part = stats::part(plane, size, i);
        let (fourth, known) = part.mean_and_known(|value| {
            let square = (value - mean) * (value - mean);
            square * square
        });
        let pixels = known as f64;
        let spread = if total > 0.0 {
            (fourth / (total * total) - 1.0).clamp(SPREADS[0], SPREADS[1])
        } else {
            SPREADS[0]
        };
        let own = noise * (spread / pixels).sqrt();
        let error = own.hypot(noise * found.of_level);
        // A patch's variance is about its own mean, which has a share of the noise.
        let noise = noise * (1.0 - 1.0 / pixels);
        sums.patches += 1.0;
        sums.noise += noise;
        // An even patch has no detail, whatever noise it should have.
        if total > 0.0 {
            sums.roots += root(total - noise, error);
        }
        if error > 0.0 {
            sums.scales += error.sqrt();
            sums.own += ROOT_DEVIATION * ROOT_DEVIATION * own * own / error;
            sums.shared += ROOT_SLOPE * noise * found.of_all / error.sqrt();
        }
    }
    sums
}

/// Nearly unbiased root of a difference of variances that is known with a standard error; see the head of this file.
fn root(difference: f64, error: f64) -> f64 {
    let size = difference.abs();
    let lift = match error > 0.0 {
        true => LIFT * error * (-size / error).exp(),
        false => 0.0,
    };
    let root = (size + lift).sqrt();
    match difference >= 0.0 {
        true => root,
        false => -BELOW * root,
    }
}

#[cfg(test)]
mod tests;
