//! The sensor: linear radiance becomes stored numbers. The only lossy step.

use std::borrow::Cow;
use std::f64::consts::TAU;
use uw_media::Spectrum;

use rayon::prelude::*;

use crate::image::{Counts, Frame, Picture};
use crate::scene::{Exposure, Noise, Sensor, WhiteBalance};

impl Sensor {
    /// Exposes a picture: vignetting, exposure, noise, white balance, colour matrix, clipping to [0, 1], encoding, rounding to the nearest
    /// count.
    ///
    /// The noise depends on `seed`, the pixel's place and the channel alone, not on the number of threads.
    /// Radiance that is not a number counts as 0.
    pub fn expose(&self, picture: &Picture, seed: u64) -> Frame {
        let picture = &*self.seen(picture);
        let means = channel_means(picture);
        let factor = self.exposure_factor_of(|| means);
        let colours = self.colours(means);
        let counts = if self.bits == 16 {
            Counts::Bits16(self.counts(picture, (factor, colours), seed, |encoded| {
                quantise(encoded, u16::MAX.into()) as u16
            }))
        } else {
            Counts::Bits8(self.counts(picture, (factor, colours), seed, |encoded| {
                quantise(encoded, u8::MAX.into()) as u8
            }))
        };
        Frame {
            width: picture.width,
            height: picture.height,
            counts,
        }
    }

    /// What the lens leaves of a picture's radiance.
    pub fn seen<'p>(&self, picture: &'p Picture) -> Cow<'p, Picture> {
        let Some(lens) = self.vignetting else {
            return Cow::Borrowed(picture);
        };
        let size = (picture.width, picture.height);
        let left = |(i, radiance): (usize, &[f32; 3])| {
            let i = i as u32;
            let share = lens.share_at((i % size.0, i / size.0), size) as f32;
            radiance.map(|value| share * value)
        };
        Cow::Owned(Picture {
            data: picture.data.iter().enumerate().map(left).collect(),
            ..*picture
        })
    }

    /// Factor from radiance, W/(m² sr), to the linear signal. For a picture that is black all over,
    /// which no factor brings to a mean, it is 1.
    pub fn exposure_factor(&self, picture: &Picture) -> f64 {
        self.exposure_factor_of(|| channel_means(&self.seen(picture)))
    }

    /// The same of a picture whose channels have these mean radiances, which are asked for where they count.
    pub fn exposure_factor_of(&self, channel_means: impl FnOnce() -> Spectrum) -> f64 {
        match self.exposure {
            Exposure::Fixed(factor) => factor,
            Exposure::AutoMean(wanted) => {
                let means = channel_means();
                let stored = transformed(&self.colours(means), means);
                let mean = stored.iter().sum::<f64>() / 3.0;
                if mean > 0.0 { wanted / mean } else { 1.0 }
            }
        }
    }

    /// The sensor as it is set for a picture whose channels have these mean radiances: what it makes of others no longer
    /// depends on them.
    pub fn set_for(&self, channel_means: Spectrum) -> Self {
        Self {
            exposure: Exposure::Fixed(self.exposure_factor_of(|| channel_means)),
            white_balance: WhiteBalance::None,
            color_matrix: self.colours(channel_means),
            ..*self
        }
    }

    /// What becomes of a signal with noise before it is clipped: the colour matrix times the white balance of a picture whose
    /// channels have these means.
    pub fn colours(&self, channel_means: Spectrum) -> [Spectrum; 3] {
        let gains = self.white_gains(channel_means);
        self.color_matrix
            .map(|row| std::array::from_fn(|k| row[k] * gains[k]))
    }

    /// Factor of each channel's signal by the white balance. Grey: those that make the channels' means equal, of which green
    /// keeps its own; 1 for a channel that is black all over.
    fn white_gains(&self, means: Spectrum) -> Spectrum {
        match self.white_balance {
            WhiteBalance::None => [1.0; 3],
            WhiteBalance::Gains(gains) => gains,
            WhiteBalance::Gray => means.map(|mean| match mean > 0.0 && means[1] > 0.0 {
                true => means[1] / mean,
                false => 1.0,
            }),
        }
    }

    fn counts<T: Send>(
        &self,
        picture: &Picture,
        (factor, colours): (f64, [Spectrum; 3]),
        seed: u64,
        quantise: impl Fn(f64) -> T + Sync,
    ) -> Vec<T> {
        let count = |(pixel, radiance): (usize, &[f32; 3])| {
            let signal: Spectrum = std::array::from_fn(|k| {
                // What is no number counts as no light, and so it stays in its own channel.
                let signal = f64::from(radiance[k]) * factor;
                let signal = if signal.is_nan() { 0.0 } else { signal };
                self.noisy(signal, seed, (3 * pixel + k) as u64)
            });
            transformed(&colours, signal).map(|signal| {
                let signal = clip(signal);
                quantise(self.encoding.code(signal))
            })
        };
        let pixels = picture.data.par_iter().enumerate();
        pixels.flat_map_iter(count).collect()
    }

    /// The linear signal with noise, not yet clipped. `index` counts channels of pixels row by row.
    fn noisy(&self, signal: f64, seed: u64, index: u64) -> f64 {
        match self.noise {
            Some(noise) => signal + noise.standard_deviation(signal) * standard_normal(seed, index),
            None => signal,
        }
    }
}

impl Noise {
    /// Standard deviation of a linear signal before clipping, sqrt(a·y + b); negative signals count as 0.
    pub fn standard_deviation(&self, signal: f64) -> f64 {
        (self.a * signal.max(0.0) + self.b).sqrt()
    }
}

/// A matrix times the channels. Channels that a row leaves out do not count, however bright they are.
fn transformed(matrix: &[Spectrum; 3], channels: Spectrum) -> Spectrum {
    matrix.map(|row| {
        let terms = (0..3).filter(|&k| row[k] != 0.0);
        terms.map(|k| row[k] * channels[k]).sum()
    })
}

/// Mean of the finite values of each channel.
pub fn channel_means(picture: &Picture) -> Spectrum {
    let mut sums = [(0.0, 0.0); 3];
    for pixel in &picture.data {
        for k in 0..3 {
            if pixel[k].is_finite() {
                sums[k].0 += f64::from(pixel[k]);
                sums[k].1 += 1.0;
            }
        }
    }
    sums.map(|(sum, count): (f64, f64)| sum / count.max(1.0))
}

/// To [0, 1]; what is not a number becomes 0.
fn clip(signal: f64) -> f64 {
    if signal > 0.0 { signal.min(1.0) } else { 0.0 }
}

fn quantise(encoded: f64, full_scale: f64) -> f64 {
    (encoded * full_scale).round()
}

/// A number drawn from the standard normal distribution, a function of `seed` and `index` alone (Box-Muller).
fn standard_normal(seed: u64, index: u64) -> f64 {
    let start = noise_start(seed);
    let draw = |k: u64| mix(start.wrapping_add((2 * index + k).wrapping_mul(GOLDEN)));
    // 53 random bits each; the first in (0, 1] because its logarithm is taken.
    let radius = (-2.0 * (((draw(0) >> 11) + 1) as f64 * EPSILON).ln()).sqrt();
    let angle = TAU * ((draw(1) >> 11) as f64 * EPSILON);
    radius * angle.cos()
}

/// Where the random bits of a seed's noise start.
pub(crate) fn noise_start(seed: u64) -> u64 {
    mix(seed ^ SEED_SALT)
}

/// Keeps the noise of a seed apart from other uses of the same seed.
const SEED_SALT: u64 = 0x5e45_0a11_c0de_f01e;
/// Odd integer nearest 2⁶⁴ divided by the golden ratio, the step of SplitMix64.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
/// 2⁻⁵³.
const EPSILON: f64 = 1.0 / (1_u64 << 53) as f64;

/// The output function of SplitMix64 (Steele, Lea, Flood 2014): 64 bits to 64 well-mixed bits.
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests;
