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
mod tests {
    use super::*;
    use crate::scene::Encoding;
    use uw_media::Vignetting;

    fn uniform(level: f32, width: u32, height: u32) -> Picture {
        Picture {
            data: vec![[level; 3]; width as usize * height as usize],
            ..Picture::black(width, height)
        }
    }

    fn linear_16_bits(noise: Noise) -> Sensor {
        Sensor {
            exposure: Exposure::Fixed(1.0),
            encoding: Encoding::Linear,
            bits: 16,
            noise: Some(noise),
            ..Sensor::default()
        }
    }

    fn counts_16(frame: &Frame) -> Vec<u16> {
        match &frame.counts {
            Counts::Bits16(counts) => counts.clone(),
            Counts::Bits8(_) => panic!("16 bits were asked for"),
        }
    }

    /// A plain picture is darker by the share at each pixel, and noise is that of what is left; the mean of automatic exposure counts it.
    #[test]
    fn vignetting_is_before_noise_and_exposure() {
        let lens = Vignetting::new([-0.5, 0.1, 0.0]).expect("a lens");
        let sensor = Sensor {
            vignetting: Some(lens),
            noise: None,
            ..linear_16_bits(Noise { a: 0.0, b: 0.0 })
        };
        let plain = uniform(0.5, 64, 36);
        let counts = counts_16(&sensor.expose(&plain, 1));
        for (i, count) in counts.iter().step_by(3).enumerate() {
            let i = i as u32;
            let want = 0.5 * 65_535.0 * lens.share_at((i % 64, i / 64), (64, 36));
            assert!(
                (f64::from(*count) - want).abs() < 0.51,
                "{i} {count} {want}"
            );
        }
        let auto = Sensor {
            exposure: Exposure::AutoMean(0.3),
            ..sensor
        };
        let seen = counts_16(&auto.expose(&plain, 1));
        let mean = seen.iter().map(|&c| f64::from(c)).sum::<f64>() / seen.len() as f64;
        assert!((mean / 65_535.0 - 0.3).abs() < 1e-5, "{mean}");
        let noisy = Sensor {
            noise: Some(Noise { a: 4e-4, b: 0.0 }),
            ..sensor
        };
        let corner = lens.share(1.0);
        let seeds = 0..400;
        let values: Vec<f64> = seeds
            .map(|seed| {
                f64::from(counts_16(&noisy.expose(&uniform(0.5, 8, 8), seed))[0]) / 65_535.0
            })
            .collect();
        let mean = values.iter().sum::<f64>() / 400.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 399.0;
        let share = lens.share_at((0, 0), (8, 8));
        assert!(share > corner);
        // Five standard errors of a variance of 400 values.
        let off = variance / (4e-4 * 0.5 * share) - 1.0;
        assert!(off.abs() < 5.0 * (2.0f64 / 399.0).sqrt(), "{off}");
    }

    fn counts_8(frame: &Frame) -> Vec<u8> {
        match &frame.counts {
            Counts::Bits8(counts) => counts.clone(),
            Counts::Bits16(_) => panic!("8 bits were asked for"),
        }
    }

    /// Standard normal distribution function by Simpson's rule from -9, where it is below 1e-18.
    fn normal_cdf(x: f64) -> f64 {
        let (from, steps) = (-9.0, 4000);
        let h = (x - from) / f64::from(steps);
        let weight = |i| {
            if i == 0 || i == steps {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        (0..=steps)
            .map(|i| weight(i) * normal_density(from + h * f64::from(i)))
            .sum::<f64>()
            * h
            / 3.0
    }

    fn normal_density(x: f64) -> f64 {
        (-0.5 * x * x).exp() / TAU.sqrt()
    }

    /// Mean and variance of min(max(N(y, s²), 0), 1) (Foi 2009, Signal Processing 89, 2609-2629).
    fn clipped_moments(y: f64, s: f64) -> (f64, f64) {
        let (low, high) = (y / s, (y - 1.0) / s);
        let (cdf_low, cdf_high) = (normal_cdf(low), normal_cdf(high));
        let (density_low, density_high) = (normal_density(low), normal_density(high));
        let mean = cdf_low * y - cdf_high * (y - 1.0) + s * density_low - s * density_high;
        let common = y * y - 2.0 * mean * y + s * s;
        let variance = cdf_low * common + mean * mean - cdf_high * (common + 2.0 * mean - 1.0)
            + s * density_high * (2.0 * mean - y - 1.0)
            - s * density_low * (2.0 * mean - y);
        (mean, variance)
    }

    #[test]
    fn noise_has_the_mean_and_variance_of_the_clipped_model() {
        // Foi's test values of (a, b), at the dark end, in the middle and near saturation.
        for (a, b) in [
            (0.01, 0.0016),
            (0.01, 0.0004),
            (0.0, 0.04),
            (0.033333, 0.01),
        ] {
            for level in [0.0_f32, 0.02, 0.5, 0.9, 1.0, 1.05] {
                let noise = Noise { a, b };
                let frame = linear_16_bits(noise).expose(&uniform(level, 400, 250), 11);
                let values: Vec<f64> = counts_16(&frame)
                    .into_iter()
                    .map(|count| f64::from(count) / 65535.0)
                    .collect();
                let n = values.len() as f64;
                let mean = values.iter().sum::<f64>() / n;
                let squares: Vec<f64> = values.iter().map(|value| (value - mean).powi(2)).collect();
                let variance = squares.iter().sum::<f64>() / n;
                let y = f64::from(level);
                let (expected_mean, expected_variance) = clipped_moments(y, (a * y + b).sqrt());
                // 48 comparisons: 4.5 standard errors are exceeded by chance once in 3000 runs of this test
                // under other seeds; the seed is fixed.
                let mean_error = (expected_variance / n).sqrt();
                let fourth = squares
                    .iter()
                    .map(|square| (square - variance).powi(2))
                    .sum::<f64>()
                    / n;
                let variance_error = (fourth / n).sqrt();
                assert!(
                    (mean - expected_mean).abs() < 4.5 * mean_error,
                    "mean at {a} {b} {level}: {mean} {expected_mean}"
                );
                assert!(
                    (variance - expected_variance).abs() < 4.5 * variance_error,
                    "variance at {a} {b} {level}: {variance} {expected_variance}"
                );
            }
        }
    }

    #[test]
    fn noise_depends_on_seed_place_and_channel_but_not_on_threads() {
        let sensor = linear_16_bits(Noise { a: 0.01, b: 0.001 });
        let picture = uniform(0.4, 64, 32);
        let frame = sensor.expose(&picture, 3);
        let alone = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .expect("pool");
        assert_eq!(alone.install(|| sensor.expose(&picture, 3)), frame);
        assert_ne!(sensor.expose(&picture, 4), frame);
        let counts = counts_16(&frame);
        let pair_products = |step: usize| {
            let pairs = counts.iter().zip(&counts[step..]);
            let deviations = pairs
                .map(|(x, y)| (f64::from(*x) / 65535.0 - 0.4) * (f64::from(*y) / 65535.0 - 0.4));
            deviations.sum::<f64>() / (counts.len() - step) as f64 / 0.005
        };
        // Correlation between channels, pixels and rows: 0 within 4.5 standard errors of 1/sqrt(6144).
        for step in [1, 2, 3, 6, 192] {
            assert!(
                pair_products(step).abs() < 4.5 / 6144.0_f64.sqrt(),
                "step {step}"
            );
        }
    }

    #[test]
    fn without_noise_counts_are_the_encoded_signal_rounded() {
        let mut picture = uniform(0.5, 3, 1);
        picture.data = vec![
            [0.0, 0.25, 0.5],
            [1.0, 2.0, -1.0],
            [0.001, f32::NAN, f32::INFINITY],
        ];
        let srgb = Sensor {
            exposure: Exposure::Fixed(1.0),
            encoding: Encoding::Srgb,
            bits: 8,
            noise: None,
            ..Sensor::default()
        };
        // sRGB: 0.25 is 136.96, 0.5 is 187.52, 0.001 is 3.29 of 255.
        assert_eq!(
            counts_8(&srgb.expose(&picture, 0)),
            [0, 137, 188, 255, 255, 0, 3, 0, 255]
        );
        let linear = Sensor {
            encoding: Encoding::Linear,
            bits: 16,
            ..srgb
        };
        assert_eq!(
            counts_16(&linear.expose(&picture, 0))[..5],
            [0, 16384, 32768, 65535, 65535]
        );
        let double = Sensor {
            exposure: Exposure::Fixed(2.0),
            ..linear
        };
        assert_eq!(counts_16(&double.expose(&picture, 0))[1], 32768);
    }

    #[test]
    fn automatic_exposure_brings_the_mean_to_its_value() {
        let auto = Sensor {
            exposure: Exposure::AutoMean(0.4),
            encoding: Encoding::Linear,
            bits: 16,
            noise: None,
            ..Sensor::default()
        };
        let mut picture = uniform(0.0, 2, 1);
        picture.data = vec![[0.01, 0.02, 0.03], [0.02, 0.03, 0.01]];
        assert!((auto.exposure_factor(&picture) - 20.0).abs() < 1e-5);
        let counts = counts_16(&auto.expose(&picture, 0));
        let mean = counts.iter().map(|count| f64::from(*count)).sum::<f64>() / 6.0 / 65535.0;
        assert!((mean - 0.4).abs() < 1e-5);
        assert_eq!(auto.exposure_factor(&Picture::black(4, 4)), 1.0);
    }

    #[test]
    fn white_balance_makes_a_grey_world_grey_after_the_noise() {
        let picture = Picture {
            width: 2,
            height: 1,
            data: vec![[0.05, 0.2, 0.1], [0.15, 0.4, 0.3]],
        };
        let of = |white_balance, exposure| Sensor {
            white_balance,
            exposure,
            encoding: Encoding::Linear,
            bits: 16,
            ..Sensor::default()
        };
        let stored = |sensor: Sensor| -> Vec<f64> {
            let counts = counts_16(&sensor.expose(&picture, 1));
            counts
                .iter()
                .map(|&count| f64::from(count) / 65_535.0)
                .collect()
        };
        let gray = stored(of(WhiteBalance::Gray, Exposure::Fixed(1.0)));
        for k in [0, 2] {
            assert!((gray[k] + gray[k + 3] - gray[1] - gray[4]).abs() < 1e-4);
        }
        let auto = stored(of(WhiteBalance::Gray, Exposure::AutoMean(0.4)));
        assert!((auto.iter().sum::<f64>() / 6.0 - 0.4).abs() < 1e-4);
        let gains = stored(of(
            WhiteBalance::Gains([2.0, 1.0, 0.5]),
            Exposure::Fixed(1.0),
        ));
        assert!((gains[0] - 0.1).abs() < 1e-4 && (gains[5] - 0.15).abs() < 1e-4);
        // What the matrix makes of the balanced signal, clipped only then.
        let matrix = stored(Sensor {
            color_matrix: [[1.5, -0.5, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 2.0]],
            ..of(WhiteBalance::Gains([2.0, 1.0, 0.5]), Exposure::Fixed(1.0))
        });
        for (got, expected) in matrix.iter().zip([0.05, 0.2, 0.0, 0.25, 0.4, 0.0]) {
            assert!((got - expected).abs() < 1e-4, "{matrix:?}");
        }
    }
}
