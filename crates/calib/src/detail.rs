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
use crate::noise::{self, NoiseModel, NoiseSource, Tiles};
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
    /// Share of all pixels that are 0, in [0, 1].
    pub black: [f64; 3],
    /// Share of all pixels at full scale, in [0, 1].
    pub saturated: [f64; 3],
}

/// The picture as it was stored behind a lens, of a picture that was made even.
pub(crate) struct Behind<'a> {
    pub(crate) even: &'a Even,
    pub(crate) pixels: &'a [[f64; 3]],
}

impl Detail {
    /// Measures the picture of a grid, stored in steps of `step` counts. Of
    /// a picture that was made even, `behind` is how it was stored. `None` where the noise is to be taken from the picture and patches are smaller
    /// than 3 × 3 pixels.
    pub(crate) fn measure(
        grid: &PatchGrid,
        planes: &Planes,
        step: f64,
        model: &NoiseModel,
        behind: Option<&Behind<'_>>,
    ) -> Option<Self> {
        let size = [grid.width / PATCH_COLUMNS, grid.height / PATCH_ROWS];
        let corners: Vec<usize> = (0..PATCH_ROWS * PATCH_COLUMNS)
            .map(|patch| stats::corner([grid.width, grid.height], patch))
            .collect();
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
            let is = |so: bool| f64::from(u8::from(so));
            detail.black[k] = whole.mean(|value| is(value <= 0.0));
            detail.saturated[k] = whole.mean(|value| is(value >= FULL_SCALE));
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
    let size = [grid.width, grid.height];
    // Mean count of each patch before it was made even, and by how much deviations have grown.
    let before = |(patch, &corner): (&PatchStats, &usize)| {
        let Some(behind) = behind else {
            return (patch.mean[k], 1.0);
        };
        let middle = corner + tiles.height / 2 * grid.width + tiles.width / 2;
        let place = [middle % grid.width, middle / grid.width];
        let share = behind.even.share(place, size);
        behind.even.before(patch.mean[k], share)
    };
    let patches = grid.patches.iter().zip(tiles.corners);
    match model {
        NoiseModel::Picture => {
            let found = match behind {
                Some(behind) => {
                    let stored: Vec<f64> = behind.pixels.iter().map(|pixel| pixel[k]).collect();
                    noise::estimate(tiles, &stored)?
                }
                None => noise::estimate(tiles, plane)?,
            };
            let grown = patches.zip(&found.patches).map(|(patch, noise)| {
                let (_, growth) = before(patch);
                noise * growth * growth
            });
            Some(ChannelNoise {
                patches: grown.collect(),
                of_level: found.of_level,
                of_all: found.of_all,
            })
        }
        NoiseModel::Sensor(sensor) => {
            let of = |patch: (&PatchStats, &usize)| {
                let (mean, growth) = before(patch);
                let square = growth * growth;
                square * sensor.of_patch(mean, patch.0.std[k] * patch.0.std[k] / square, step)
            };
            Some(ChannelNoise {
                patches: patches.map(of).collect(),
                of_level: 0.0,
                of_all: 0.0,
            })
        }
    }
}

fn channel(grid: &PatchGrid, k: usize, plane: &[f64], found: &ChannelNoise) -> Sums {
    let size = [grid.width, grid.height];
    let mut sums = Sums::default();
    for (i, (patch, &noise)) in grid.patches.iter().zip(&found.patches).enumerate() {
        let (mean, total) = (patch.mean[k], patch.std[k] * patch.std[k]);
        let part = stats::part(plane, size, i);
        let pixels = (part.width * part.height) as f64;
        let fourth = part.mean(|value| {
            let square = (value - mean) * (value - mean);
            square * square
        });
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
