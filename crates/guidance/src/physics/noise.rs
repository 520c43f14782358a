//! The sensor's noise in what a picture shows of a target, from place to place: where less light falls, reflectance is known less well.

use std::sync::Arc;

use uw_calib::response::CountResponse;

use super::cleared::LinearPicture;
use super::grid::{self, PATCHES};
use super::light::Seen;

/// Side of the blocks by whose mean noise is known, pixels.
const BLOCK_PX: usize = 6;

/// Least light that is told from none, over the most of the picture.
const LEAST_LIGHT: f64 = 1e-3;

/// Light on an even target, from place to place.
pub(super) struct Light<'a> {
    gain: &'a [f64; PATCHES],
    least: f64,
}

impl<'a> Light<'a> {
    /// By its values in the middles of patches.
    pub(super) fn new(gain: &'a [f64; PATCHES]) -> Self {
        let most = gain.iter().fold(0.0, |a: f64, &b| a.max(b));
        Self {
            gain,
            least: (LEAST_LIGHT * most).max(1e-12),
        }
    }

    /// At the image coordinates (`u`, `v`) in [0, 1]; a little where there is none.
    pub(super) fn at(&self, u: f64, v: f64) -> f64 {
        grid::at(self.gain, u, v).max(self.least)
    }
}

/// Variance that the sensor's noise has in a picture's pixels, and in means over many of them times their number: less than that where
/// neighbours have noise in common.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Noise {
    pub(super) of_pixel: f64,
    of_means: f64,
}

impl Noise {
    /// Variance of the means over `pixels` pixels: near one pixel that of a pixel, far from it that of independent ones. Right to 6 % for
    /// means over 2 × 2 to 8 × 8 pixels that are interpolated by cubics and 0.6 to 2 stored pixels wide.
    pub(super) fn of(self, pixels: f64) -> f64 {
        match pixels > 1.0 {
            true => 1.0 / (1.0 / self.of_pixel + (pixels - 1.0) / self.of_means),
            false => self.of_pixel,
        }
    }

    /// Mean of noise and weight.
    fn mean(all: impl Iterator<Item = (Self, f64)>) -> Self {
        let (mut sum, mut weights) = (Self::default(), 0.0);
        for (noise, weight) in all {
            sum.of_pixel += weight * noise.of_pixel;
            sum.of_means += weight * noise.of_means;
            weights += weight;
        }
        let weights = weights.max(f64::MIN_POSITIVE);
        Self {
            of_pixel: sum.of_pixel / weights,
            of_means: sum.of_means / weights,
        }
    }
}

/// Noise of a channel's reflectance over a picture or a part of it.
#[derive(Clone, Debug)]
pub(super) struct NoiseMap {
    /// Of the picture's blocks, row by row.
    blocks: Arc<[Noise]>,
    /// 1 over the square of the light on them.
    dimness: Arc<[f64]>,
    /// Blocks across and down.
    grid: [usize; 2],
    /// Sides of a block, pixels.
    block_px: [f64; 2],
    /// Upper left corner of the part, pixels.
    corner_px: [usize; 2],
    /// Size of the part, pixels.
    size_px: [usize; 2],
    /// Variance of a pixel's noise in the part where light is, and the mean square of light.
    lit: f64,
    bright: f64,
    /// Variance of the target's detail.
    detail: f64,
}

impl NoiseMap {
    /// What the sensor's noise makes of the reflectance, by the mean signal of small blocks.
    pub(super) fn new(
        picture: &LinearPicture,
        seen: &Seen,
        exposure: f64,
        k: usize,
        response: &CountResponse,
    ) -> Self {
        let grid = [picture.width, picture.height].map(|side| (side / BLOCK_PX).max(1));
        let middle = |i: usize| {
            let at = [i % grid[0], i / grid[0]];
            [0, 1].map(|axis| (at[axis] as f64 + 0.5) / grid[axis] as f64)
        };
        let of_target = Light::new(&seen.gain[k]);
        let lit = |i: usize| {
            let [u, v] = middle(i);
            of_target.at(u, v)
        };
        let light: Vec<f64> = (0..grid[0] * grid[1]).map(lit).collect();
        let block = |i: usize| {
            let corner_px = [i % grid[0] * BLOCK_PX, i / grid[0] * BLOCK_PX];
            let mean = block_mean(picture, corner_px, k);
            let [u, v] = middle(i);
            let of = picture.origin(u, v);
            let gain = exposure * light[i];
            let stored = noise_variance(of.share * mean, response) / (of.share * gain).powi(2);
            Noise {
                of_pixel: of.left * stored,
                of_means: stored / of.pixels,
            }
        };
        let size_px = [picture.width, picture.height];
        let whole = Self {
            blocks: (0..light.len()).map(block).collect(),
            dimness: light.iter().map(|light| light.powi(-2)).collect(),
            grid,
            block_px: [0, 1].map(|i| size_px[i] as f64 / grid[i] as f64),
            corner_px: [0; 2],
            size_px,
            lit: 0.0,
            bright: 0.0,
            detail: 0.0,
        };
        whole.part([0; 2], size_px)
    }

    /// The same noise everywhere.
    #[cfg(test)]
    pub(super) fn even(noise: Noise) -> Self {
        Self {
            blocks: [noise].into(),
            dimness: [1.0].into(),
            grid: [1; 2],
            block_px: [f64::INFINITY; 2],
            corner_px: [0; 2],
            size_px: [1; 2],
            lit: noise.of_pixel,
            bright: 1.0,
            detail: 0.0,
        }
    }

    /// The picture's mean noise everywhere.
    pub(super) fn averaged(&self) -> Self {
        let mean = Noise::mean(self.blocks.iter().map(|&noise| (noise, 1.0)));
        Self {
            blocks: self.blocks.iter().map(|_| mean).collect(),
            dimness: self.blocks.iter().map(|_| 1.0).collect(),
            lit: mean.of_pixel,
            bright: 1.0,
            ..self.clone()
        }
    }

    /// A part of the picture.
    pub(super) fn part(&self, corner_px: [usize; 2], size_px: [usize; 2]) -> Self {
        let part = Self {
            corner_px: [0, 1].map(|i| self.corner_px[i] + corner_px[i]),
            size_px,
            ..self.clone()
        };
        let by_light = part.all().map(|i| (part.blocks[i], 1.0 / part.dimness[i]));
        let (sum, n) = part.all().fold((0.0, 0.0), |(sum, n), i| {
            (sum + 1.0 / part.dimness[i], n + 1.0)
        });
        Self {
            lit: Noise::mean(by_light).of_pixel,
            bright: sum / f64::max(n, 1.0),
            ..part
        }
    }

    /// For a target whose detail has that variance: where there is more noise than that, less counts.
    pub(super) fn before(&self, detail: f64) -> Self {
        Self {
            detail: detail.max(0.0),
            ..self.clone()
        }
    }

    /// What the variance of a place counts, 1 where light is: the inverse square of its error, which goes with the variance of detail and noise
    /// together. Noise is taken to go with the light alone here: where bright spots of the target, which have more of it, counted less, detail would.
    fn weight(&self, dimness: f64) -> f64 {
        let lit = (self.detail + self.lit).max(f64::MIN_POSITIVE);
        let here = self.detail + self.lit * self.bright * dimness;
        (lit / here.max(lit)).powi(2)
    }

    /// Mean over the part, places weighted.
    pub(super) fn mean(&self) -> Noise {
        Noise::mean(self.weighted())
    }

    /// By how much the error of that mean is larger than that of even noise in as many pixels.
    pub(super) fn unevenness(&self) -> f64 {
        let (mut sum, mut square, mut n) = (0.0, 0.0, 0.0);
        for (noise, weight) in self.weighted() {
            let counts = weight * noise.of_pixel;
            sum += counts;
            square += counts * counts;
            n += 1.0;
        }
        match sum > 0.0 {
            true => (n * square).sqrt() / sum,
            false => 1.0,
        }
    }

    fn weighted(&self) -> impl Iterator<Item = (Noise, f64)> + '_ {
        self.all()
            .map(|i| (self.blocks[i], self.weight(self.dimness[i])))
    }

    fn all(&self) -> impl Iterator<Item = usize> + '_ {
        self.blocks_in([0; 2], self.size_px)
    }

    /// Mean over a window of the part, and what the variance in it counts.
    pub(super) fn over(&self, corner_px: [usize; 2], size_px: [usize; 2]) -> (Noise, f64) {
        let blocks = || self.blocks_in(corner_px, size_px);
        let noise = Noise::mean(blocks().map(|i| (self.blocks[i], 1.0)));
        let (sum, n) = blocks().fold((0.0, 0.0), |(sum, n), i| (sum + self.dimness[i], n + 1.0));
        (noise, self.weight(sum / f64::max(n, 1.0)))
    }

    /// The blocks whose middles lie in a window, or that in which its own lies.
    fn blocks_in(
        &self,
        corner_px: [usize; 2],
        size_px: [usize; 2],
    ) -> impl Iterator<Item = usize> + '_ {
        let [across, down] = [0, 1].map(|i| {
            let from = (self.corner_px[i] + corner_px[i]) as f64 / self.block_px[i];
            let to = from + size_px[i] as f64 / self.block_px[i];
            let most = self.grid[i] - 1;
            let [first, end] = [from, to].map(|at| (at + 0.5) as usize);
            match first < end {
                true => first.min(most)..end.min(most + 1),
                false => {
                    let own = ((0.5 * (from + to)) as usize).min(most);
                    own..own + 1
                }
            }
        });
        down.flat_map(move |y| across.clone().map(move |x| y * self.grid[0] + x))
    }
}

/// Mean signal of a block.
fn block_mean(picture: &LinearPicture, [left, top]: [usize; 2], k: usize) -> f64 {
    let (right, bottom) = (
        (left + BLOCK_PX).min(picture.width),
        (top + BLOCK_PX).min(picture.height),
    );
    let row = |y: usize| &picture.signal[y * picture.width + left..y * picture.width + right];
    let sum: f64 = (top..bottom)
        .flat_map(row)
        .map(|pixel| f64::from(pixel[k]))
        .sum();
    sum / ((right - left) * (bottom - top)).max(1) as f64
}

/// Variance of the linear signal as read back from its count, noise and rounding together.
fn noise_variance(signal: f64, response: &CountResponse) -> f64 {
    let step = (0.02 * signal).max(1e-4);
    let (low, _) = response.at((signal - step).max(0.0) as f32);
    let (high, _) = response.at((signal + step) as f32);
    let (_, variance) = response.at(signal.max(0.0) as f32);
    let slope = f64::from(high - low) / (signal + step - (signal - step).max(0.0));
    f64::from(variance) / (slope * slope).max(1.0)
}

#[cfg(test)]
mod tests;
