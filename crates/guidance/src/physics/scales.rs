//! Variance scale by scale: freed of water and noise, and as sums of waves.

use super::waves::{Waves, mean};

/// Least and most of what the finest octave in sight is taken to hold of the one above it.
const FINER: [f64; 2] = [0.2, 1.0];
/// What an octave finer than a pixel holds of the one above it, over what the finest in sight does: things are smooth at last. With 1
/// contrast from six times nearer comes out 22 % too high in pictures of 320 pixels, in air, with this 10 %; of 1280 pixels 2 and 1 %
/// (`tools/nearer_contrast.py`).
const SMOOTHING: f64 = 0.8;
/// Octaves finer than a pixel.
pub(super) const FINER_OCTAVES: usize = 5;
/// What a scale is expected to hold of the variance of the next coarser one, octave for octave, before the picture is asked: natural
/// scenes have nearly as much in each octave (Field 1987, J. Opt. Soc. Am. A 4, 2379).
const EXPECTED_FALL: f64 = 0.85;
/// How well that is expected, as a share of it; chosen so that predictions before ten targets lie in their intervals
/// (docs/physics.md).
const EXPECTED_DOUBT: f64 = 0.6;
/// Least contrast left of a scale that is undone.
pub(super) const LEAST_LEFT: f64 = 0.02;
/// Standard errors from 0 beyond which a variance is none, or is what was measured.
const FAR_FROM_NONE: f64 = 6.0;

/// What a picture shows scale by scale, from fine to coarse.
#[derive(Default)]
pub(super) struct Scales {
    pub(super) variance: Vec<f64>,
    pub(super) doubt: Vec<f64>,
    pub(super) left: Vec<f64>,
}

impl Scales {
    /// Frees what was measured of the water, where `left` of a wave's contrast is.
    pub(super) fn clear(&mut self, windows_m: &[f64], left: &dyn Fn(f64) -> f64) {
        let waves = Waves::new(windows_m);
        let power = waves.each(|frequency| left(frequency).powi(2));
        let measured: Vec<f64> = (self.variance.iter().zip(&self.doubt))
            .map(|(&variance, &doubt)| positive(variance, doubt))
            .collect();
        for (i, weights) in waves.weights(&measured, &power).iter().enumerate() {
            let left = mean(weights, &power).max(LEAST_LEFT * LEAST_LEFT);
            self.variance[i] /= left;
            self.doubt[i] /= left;
            self.left.push(left.sqrt());
        }
    }

    /// Leaves open such a share of all variances besides.
    pub(super) fn doubt_share(&mut self, share: f64) {
        for (doubt, variance) in self.doubt.iter_mut().zip(&self.variance) {
            *doubt += share * variance;
        }
    }

    /// Where noise hides a scale it is taken to be like the next coarser one, as far as the picture does not contradict: the mean of
    /// both, weighted by how well they are known.
    pub(super) fn expect(&mut self, windows_m: &[f64]) {
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

/// Variance by scale as sums of waves, with octaves finer than a pixel of the picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bands {
    pub(super) windows_m: Vec<f64>,
    pub(super) variance: Vec<f64>,
    waves: Waves,
    /// Per band what each wave's power counts.
    weights: Vec<Vec<f64>>,
}

impl Bands {
    /// Of what a picture shows between `windows_m`.
    pub(super) fn new(windows_m: &[f64], variance: &[f64]) -> Self {
        let [least, most] = FINER;
        let falling = match variance {
            [finest, next, ..] if *next > 0.0 => (finest / next).clamp(least, most),
            _ => least,
        };
        let (mut windows, mut all) = (windows_m.to_vec(), variance.to_vec());
        for _ in 0..FINER_OCTAVES {
            windows.insert(0, 0.5 * windows[0]);
            all.insert(0, SMOOTHING * falling * all[0]);
        }
        let waves = Waves::new(&windows);
        let weights = waves.weights(&all, &waves.each(|_| 1.0));
        Self {
            windows_m: windows,
            variance: all,
            waves,
            weights,
        }
    }

    /// Share of each band's variance that is left where `left` of a wave's contrast is.
    pub(super) fn left(&self, left: &dyn Fn(f64) -> f64) -> Vec<f64> {
        let power = self.waves.each(|frequency| left(frequency).powi(2));
        self.weights.iter().map(|own| mean(own, &power)).collect()
    }
}
