//! What a sensor makes of a linear signal on average: mean and variance of the stored count.

use std::f64::consts::SQRT_2;

use crate::Encoding;

/// Entries of the tables, evenly spaced in the root of the signal.
const ENTRIES: usize = 4096;
/// Largest signal tabulated: the noise may bring a signal beyond 1 back into range.
pub(crate) const LARGEST: f64 = 1.44;
/// Largest count.
const FULL: usize = 255;

/// Signal-dependent noise of a linear signal y in [0, 1]: variance a·y + b, then clipped to [0, 1] (Foi 2009).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinearNoise {
    /// Poissonian part, finite, >= 0.
    pub a: f64,
    /// Gaussian part, finite, >= 0.
    pub b: f64,
}

impl LinearNoise {
    /// Standard deviation at the signal `y` before clipping; negative signals count as 0.
    pub fn standard_deviation(&self, y: f64) -> f64 {
        (self.a * y.max(0.0) + self.b).sqrt()
    }
}

/// Mean and variance of the 8-bit count that a sensor stores for a linear signal: noise, clipping, encoding and
/// rounding, in closed form from the probability that the count reaches each value.
#[derive(Clone, Debug)]
pub struct CountResponse {
    /// (mean, variance) per entry.
    table: Vec<(f32, f32)>,
}

impl CountResponse {
    /// The response of a sensor of this encoding and noise; counts are taken as 8-bit ones.
    pub fn new(encoding: Encoding, noise: LinearNoise) -> Self {
        let thresholds = thresholds(encoding, FULL);
        let table = (0..=ENTRIES)
            .map(|i| {
                let (mean, variance) = moments(entry_signal(i, ENTRIES), noise, &thresholds);
                (mean as f32, variance as f32)
            })
            .collect();
        Self { table }
    }

    /// Mean and variance of the count at `signal`; what is below 0 counts as 0.
    #[inline]
    pub fn at(&self, signal: f32) -> (f32, f32) {
        let entry = signal.max(0.0).sqrt() * (ENTRIES as f32 / LARGEST.sqrt() as f32);
        let i = (entry as usize).min(ENTRIES - 1);
        let f = (entry - i as f32).min(1.0);
        let ((m0, v0), (m1, v1)) = (self.table[i], self.table[i + 1]);
        (m0 + f * (m1 - m0), v0 + f * (v1 - v0))
    }
}

/// The signal of entry `i` of `entries` + 1 that are evenly spaced in its root.
pub(crate) fn entry_signal(i: usize, entries: usize) -> f64 {
    let root = i as f64 / entries as f64 * LARGEST.sqrt();
    root * root
}

/// The signals from which the stored level is 1, 2, .. of `levels`.
pub(crate) fn thresholds(encoding: Encoding, levels: usize) -> Vec<f64> {
    let counts_per_level = FULL as f64 / levels as f64;
    (1..=levels)
        .map(|level| encoding.light((level as f64 - 0.5) * counts_per_level))
        .collect()
}

/// Mean and variance of the stored level at signal `y`; `thresholds[c - 1]` is the signal from which the level is c.
pub(crate) fn moments(y: f64, noise: LinearNoise, thresholds: &[f64]) -> (f64, f64) {
    let deviation = noise.standard_deviation(y);
    let (mut mean, mut square) = (0.0, 0.0);
    for (i, threshold) in thresholds.iter().enumerate() {
        let reached = if deviation > 0.0 {
            normal_cdf((y - threshold) / deviation)
        } else {
            f64::from(u8::from(y >= *threshold))
        };
        mean += reached;
        square += (2 * i + 1) as f64 * reached;
    }
    (mean, (square - mean * mean).max(0.0))
}

/// Standard normal distribution function; error below 1.5e-7 (Abramowitz and Stegun 7.1.26).
pub(crate) fn normal_cdf(x: f64) -> f64 {
    let z = x.abs() / SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * z);
    let poly = t
        * (0.254_829_592
            + t * (-0.284_496_736
                + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let half_tail = 0.5 * poly * (-z * z).exp();
    if x >= 0.0 { 1.0 - half_tail } else { half_tail }
}
