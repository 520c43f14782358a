//! Asymmetric generalised normal distributions, fitted by moments.

use std::sync::OnceLock;

/// Range and step of the shapes looked at.
const SMALLEST_SHAPE: f64 = 0.2;
const LARGEST_SHAPE: f64 = 10.0;
const SHAPE_STEP: f64 = 0.001;

/// An asymmetric generalised normal distribution around 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aggd {
    /// Exponent: 2 is a normal distribution, 1 a double exponential.
    pub shape: f64,
    /// Scale of the negative side.
    pub left: f64,
    /// Scale of the positive side.
    pub right: f64,
}

impl Aggd {
    /// Fits the distribution by its moments; not finite when one side has no values.
    pub fn fit(values: &[f64]) -> Self {
        let (mut below, mut above) = (Side::default(), Side::default());
        let mut absolute = 0.0;
        for &v in values {
            absolute += v.abs();
            if v < 0.0 {
                below.add(v);
            } else if v > 0.0 {
                above.add(v);
            }
        }
        let n = values.len() as f64;
        let (left_std, right_std) = (below.root_mean_square(), above.root_mean_square());
        let ratio = left_std / right_std;
        let spread = (absolute / n).powi(2) / ((below.squares + above.squares) / n);
        let balanced =
            spread * (ratio.powi(3) + 1.0) * (ratio + 1.0) / (ratio * ratio + 1.0).powi(2);
        let (shape, factor) = shape_of(balanced);
        Self {
            shape: if balanced.is_finite() {
                shape
            } else {
                f64::NAN
            },
            left: left_std * factor,
            right: right_std * factor,
        }
    }

    /// Mean of the distribution.
    pub fn mean(&self) -> f64 {
        (self.right - self.left) * gamma_ratio(2.0 / self.shape, 1.0 / self.shape)
    }
}

#[derive(Default)]
struct Side {
    squares: f64,
    count: f64,
}

impl Side {
    fn add(&mut self, value: f64) {
        self.squares += value * value;
        self.count += 1.0;
    }

    fn root_mean_square(&self) -> f64 {
        (self.squares / self.count).sqrt()
    }
}

/// The shape whose Γ(2/α)²/(Γ(1/α) Γ(3/α)) is nearest to `moment`, with sqrt(Γ(1/α)/Γ(3/α)).
fn shape_of(moment: f64) -> (f64, f64) {
    static TABLE: OnceLock<Vec<f64>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let count = ((LARGEST_SHAPE - SMALLEST_SHAPE) / SHAPE_STEP).round() as usize;
        (0..=count)
            .map(|i| {
                let inverse = 1.0 / shape_at(i);
                (2.0 * ln_gamma(2.0 * inverse) - ln_gamma(inverse) - ln_gamma(3.0 * inverse)).exp()
            })
            .collect()
    });
    // The table increases.
    let after = table.partition_point(|&r| r < moment).min(table.len() - 1);
    let before = after.saturating_sub(1);
    let nearest = if moment - table[before] < table[after] - moment {
        before
    } else {
        after
    };
    let shape = shape_at(nearest);
    (shape, gamma_ratio(1.0 / shape, 3.0 / shape).sqrt())
}

fn shape_at(index: usize) -> f64 {
    SMALLEST_SHAPE + SHAPE_STEP * index as f64
}

/// Γ(a)/Γ(b).
fn gamma_ratio(a: f64, b: f64) -> f64 {
    (ln_gamma(a) - ln_gamma(b)).exp()
}

/// ln Γ(x) for x > 0 (Lanczos' approximation with g = 7, relative error below 1e-13 of Γ).
fn ln_gamma(x: f64) -> f64 {
    const COEFFICIENTS: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    let x = x - 1.0;
    let t = x + 7.5;
    let series: f64 = COEFFICIENTS[1..]
        .iter()
        .zip(1..)
        .map(|(c, i)| c / (x + f64::from(i)))
        .sum();
    0.5 * std::f64::consts::TAU.ln() + (x + 0.5) * t.ln() - t + (COEFFICIENTS[0] + series).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gamma_has_its_known_values() {
        // Γ(1/2) = sqrt(π), Γ(5) = 24, Γ(15) = 14!.
        for (x, expected) in [
            (0.5, std::f64::consts::PI.sqrt()),
            (1.0, 1.0),
            (5.0, 24.0),
            (15.0, 87_178_291_200.0),
        ] {
            assert!((ln_gamma(x).exp() / expected - 1.0).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn a_two_sided_exponential_is_recognised() {
        // Quantiles of exp(-v/2) above and exp(-v/1) below: shape 1, scales 1 and 2 where both halves are as likely.
        let quantiles = (0..20_000).map(|i| -(1.0 - (f64::from(i) + 0.5) / 20_000.0).ln());
        let values: Vec<f64> = quantiles.flat_map(|q| [2.0 * q, -2.0 * q]).collect();
        let fit = Aggd::fit(&values);
        assert!((fit.shape - 1.0).abs() < 0.01, "{fit:?}");
        assert!((fit.left - 2.0).abs() < 0.03, "{fit:?}");
        assert!(fit.mean().abs() < 1e-9);
    }

    #[test]
    fn values_without_spread_have_no_distribution() {
        assert!(!Aggd::fit(&[0.0; 100]).left.is_finite());
        assert!(!Aggd::fit(&[1.0; 100]).left.is_finite());
    }
}
