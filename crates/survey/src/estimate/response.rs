//! What the sensor makes of a linear signal on average: mean and variance of the stored count.

use std::f64::consts::SQRT_2;

use uw_render::image::srgb_to_linear;
use uw_render::scene::{Encoding, Noise, Sensor};

/// Entries of the tables, evenly spaced in the root of the signal.
const ENTRIES: usize = 4096;
/// Largest signal tabulated: the noise may bring a signal beyond 1 back into range.
const LARGEST: f64 = 1.44;
/// Largest count.
const FULL: usize = 255;

/// Mean and variance of the 8-bit count that a sensor stores for a linear signal: noise, clipping, encoding and
/// rounding, in closed form from the probability that the count reaches each value.
#[derive(Clone, Debug)]
pub struct CountResponse {
    /// (mean, variance) per entry.
    table: Vec<(f32, f32)>,
}

impl CountResponse {
    /// The response of `sensor`, whose exposure does not enter; counts are taken as 8-bit ones.
    pub fn new(sensor: &Sensor) -> Self {
        let thresholds: Vec<f64> = (1..=FULL)
            .map(|count| {
                let encoded = (count as f64 - 0.5) / FULL as f64;
                match sensor.encoding {
                    Encoding::Linear => encoded,
                    Encoding::Srgb => srgb_to_linear(encoded),
                }
            })
            .collect();
        let table = (0..=ENTRIES)
            .map(|i| {
                let root = i as f64 / ENTRIES as f64 * LARGEST.sqrt();
                let (mean, variance) = moments(root * root, sensor.noise.as_ref(), &thresholds);
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

/// Mean and variance of the count at signal `y`; `thresholds[c - 1]` is the signal from which the count is c.
fn moments(y: f64, noise: Option<&Noise>, thresholds: &[f64]) -> (f64, f64) {
    let deviation = noise.map_or(0.0, |n| n.standard_deviation(y));
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
fn normal_cdf(x: f64) -> f64 {
    let z = x.abs() / SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * z);
    let poly = t
        * (0.254_829_592
            + t * (-0.284_496_736
                + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let half_tail = 0.5 * poly * (-z * z).exp();
    if x >= 0.0 { 1.0 - half_tail } else { half_tail }
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_render::image::Picture;
    use uw_render::scene::Exposure;

    /// Exposes even pictures and compares mean and variance of their counts, in the dark, in the middle and at
    /// the clipping point.
    #[test]
    fn moments_are_those_of_exposed_pictures() {
        for noise in [
            None,
            Some(Noise { a: 2e-4, b: 1e-6 }),
            Some(Noise { a: 1e-2, b: 1e-3 }),
        ] {
            let sensor = Sensor {
                exposure: Exposure::Fixed(1.0),
                encoding: Encoding::Srgb,
                bits: 8,
                noise,
                ..Sensor::default()
            };
            let response = CountResponse::new(&sensor);
            for level in [0.0_f32, 5e-4, 0.004, 0.21, 0.6, 0.985, 1.02] {
                let picture = Picture {
                    data: vec![[level; 3]; 200 * 200],
                    ..Picture::black(200, 200)
                };
                let counts = sensor.expose(&picture, 9).in_8_bit_counts();
                let n = (3 * counts.len()) as f64;
                let all = || counts.iter().flatten();
                let mean = all().sum::<f64>() / n;
                let variance = all().map(|c| (c - mean).powi(2)).sum::<f64>() / n;
                let fourth = all().map(|c| (c - mean).powi(4)).sum::<f64>() / n;
                let (m, v) = response.at(level);
                // 4.5 standard errors, and the table's interpolation.
                let error = 4.5 * (variance / n).sqrt() + 2e-3;
                assert!(
                    (f64::from(m) - mean).abs() < error,
                    "{noise:?} {level}: {m} {mean}"
                );
                let error = 4.5 * ((fourth - variance * variance).max(0.0) / n).sqrt() + 2e-3;
                assert!(
                    (f64::from(v) - variance).abs() < error,
                    "{noise:?} {level}: {v} {variance}"
                );
            }
        }
    }
}
