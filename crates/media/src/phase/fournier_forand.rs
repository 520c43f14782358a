//! Fournier-Forand phase function (Fournier & Forand 1994; CDF of Fournier & Jonasz 1999).
//!
//! Published with `ν = (3 - μ)/2` and `δ = D x`, `D = 4/(3 (n - 1)²)`, as a quotient that loses all
//! digits at `δ = 1`. Here `m = -ν`, in (0, 1), and every piece is a quotient of `expm1` of `t = ln δ`:
//! ```text
//! Q(t) = (1 - δ^m)/(1 - δ) = expm1(m t)/expm1(t)        P(t) = 1 - Q = δ^m expm1((1-m) t)/expm1(t)
//! G(t) = (m δ^(m-1) - Q)/(1 - δ)
//! 4π p = m δ^(m-1) + (D - 1) G + Q(ln D) (3 cos²θ - 1)/4
//! ccdf = (1 - x) (Q - Q(ln D) x (1 - 2x)/2)      cdf = x + (1 - x) P + Q(ln D) x (1 - x) (1 - 2x)/2
//! B    = Q(ln D/2)/2
//! ```
//! The terms of p are positive but for the last, which never outweighs the others.

use std::f64::consts::PI;

use super::{PhaseFunction, X_FLOOR};
use crate::error::{MediaError, check};

/// Fournier-Forand phase function of particles of relative refractive index n whose sizes follow a
/// power law with exponent -mu.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FournierForand {
    n: f64,
    /// m = (mu - 3)/2, in (0, 1).
    m: f64,
    /// ln D, D = δ at 180°.
    log_d180: f64,
    d180: f64,
    /// Q at 180°.
    q180: f64,
}

const N_EXPECTED: &str = "in (1, 10]";
const B_EXPECTED: &str = "in (0, 0.5)";
const MU_EXPECTED: &str = "in (3, 5)";

impl FournierForand {
    /// From the refractive index `n` of the particles relative to the water, in (1, 10] (1.01 to 1.33 in
    /// nature), and the backscatter fraction B in (0, 0.5). B → 0.5 is Rayleigh's function.
    pub fn new(n: f64, backscatter_fraction: f64) -> Result<Self, MediaError> {
        Self::from_exponent(n, exponent(n, backscatter_fraction)?)
    }

    /// From `n` as in [`FournierForand::new`] and the slope `mu` of the size distribution, in (3, 5).
    pub fn from_mu(n: f64, mu: f64) -> Result<Self, MediaError> {
        check_index(n)?;
        check("mu", mu, MU_EXPECTED, mu > 3.0 && mu < 5.0)?;
        Self::from_exponent(n, 0.5 * (mu - 3.0))
    }

    fn from_exponent(n: f64, m: f64) -> Result<Self, MediaError> {
        let log_d180 = log_delta_180(n);
        Ok(Self {
            n,
            m,
            log_d180,
            d180: log_d180.exp(),
            q180: mean_slope(m, log_d180),
        })
    }

    /// Refractive index relative to the water.
    pub fn n(&self) -> f64 {
        self.n
    }

    /// Slope of the size distribution, in (3, 5).
    pub fn mu(&self) -> f64 {
        3.0 + 2.0 * self.m
    }

    fn log_delta(&self, x: f64) -> f64 {
        self.log_d180 + x.ln()
    }
}

/// The slope mu in (3, 5) that gives the backscatter fraction B in (0, 0.5) at relative index n > 1
/// (Mobley, Sundman & Boss 2002).
pub fn mu_from_backscatter(n: f64, backscatter_fraction: f64) -> Result<f64, MediaError> {
    Ok(3.0 + 2.0 * exponent(n, backscatter_fraction)?)
}

/// The backscatter fraction in (0, 0.5) of particles with relative index n > 1 and slope mu in (3, 5).
pub fn backscatter_from_mu(n: f64, mu: f64) -> Result<f64, MediaError> {
    Ok(FournierForand::from_mu(n, mu)?.backscatter_fraction())
}

fn check_index(n: f64) -> Result<f64, MediaError> {
    check("n", n, N_EXPECTED, n > 1.0 && n <= 10.0)
}

/// ln δ at 180°.
fn log_delta_180(n: f64) -> f64 {
    (4.0 / 3.0_f64).ln() - 2.0 * (n - 1.0).ln()
}

/// m from B: `expm1(m L) = 2B expm1(L)` with `L = ln δ(90°)`; `m = 2B` where L is 0.
fn exponent(n: f64, backscatter_fraction: f64) -> Result<f64, MediaError> {
    check_index(n)?;
    let b = backscatter_fraction;
    check("backscatter_fraction", b, B_EXPECTED, b > 0.0 && b < 0.5)?;
    let log_d90 = log_delta_180(n) - std::f64::consts::LN_2;
    Ok(if log_d90 == 0.0 {
        2.0 * b
    } else {
        (2.0 * b * log_d90.exp_m1()).ln_1p() / log_d90
    })
}

/// `Q = (1 - δ^m)/(1 - δ)` for δ = e^t, in (0, 1]; m at t = 0.
fn mean_slope(m: f64, t: f64) -> f64 {
    if t == 0.0 {
        m
    } else {
        (m * t).exp_m1() / t.exp_m1()
    }
}

/// `P = 1 - Q` without cancellation.
fn mean_slope_complement(m: f64, t: f64) -> f64 {
    if t == 0.0 {
        1.0 - m
    } else {
        (m * t).exp() * ((1.0 - m) * t).exp_m1() / t.exp_m1()
    }
}

/// `G = (m δ^(m-1) - Q)/(1 - δ)`, > 0; m (1 - m)/2 at t = 0.
fn curvature(m: f64, t: f64) -> f64 {
    /// Above this |t| the difference keeps at least 13 digits; below it the series ends within `TERMS`.
    const SERIES_BELOW: f64 = 0.1;
    const TERMS: i32 = 12;
    if t.abs() > SERIES_BELOW {
        return (mean_slope(m, t) - m * ((m - 1.0) * t).exp()) / t.exp_m1();
    }
    // With s = -t: Σ s^(k-2) (1 + m + .. + m^(k-2))/k!, k from 2.
    let s = -t;
    let (mut sum, mut power, mut partial) = (0.0, 0.5, 1.0);
    for k in 2..2 + TERMS {
        sum += power * partial;
        power *= s / f64::from(k + 1);
        partial = partial * m + 1.0;
    }
    let t_over_expm1 = if t == 0.0 { 1.0 } else { t / t.exp_m1() };
    m * (1.0 - m) * (m * t).exp() * sum * t_over_expm1 * t_over_expm1
}

impl PhaseFunction for FournierForand {
    fn value(&self, x: f64) -> f64 {
        let x = x.clamp(X_FLOOR, 1.0);
        let t = self.log_delta(x);
        let cos_theta = 1.0 - 2.0 * x;
        let peak = self.m * ((self.m - 1.0) * t).exp();
        let body = (self.d180 - 1.0) * curvature(self.m, t);
        let back = 0.25 * self.q180 * (3.0 * cos_theta * cos_theta - 1.0);
        (peak + body + back) / (4.0 * PI)
    }

    fn cdf(&self, x: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        let x = x.clamp(X_FLOOR, 1.0);
        let forward = mean_slope_complement(self.m, self.log_delta(x));
        let back = 0.5 * self.q180 * x * (1.0 - x) * (1.0 - 2.0 * x);
        (x + (1.0 - x) * forward + back).min(1.0)
    }

    fn ccdf(&self, x: f64) -> f64 {
        if x <= 0.0 {
            return 1.0;
        }
        let x = x.clamp(X_FLOOR, 1.0);
        let q = mean_slope(self.m, self.log_delta(x));
        ((1.0 - x) * (q - 0.5 * self.q180 * x * (1.0 - 2.0 * x))).min(1.0)
    }

    /// `1 - 2 E[x]` with `E[x] = ∫ (1 - x) Q dx` by quadrature in ln x, to about 1e-13.
    fn mean_cosine(&self) -> f64 {
        const REACH: f64 = 42.0;
        const STEPS: usize = 336;
        let mean_x = super::solve::gauss_legendre(0.0, REACH, STEPS, |v| {
            let x = (-v).exp();
            (1.0 - x) * mean_slope(self.m, self.log_d180 - v) * x
        });
        1.0 - 2.0 * mean_x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mu_and_backscatter_are_inverse_to_each_other() -> Result<(), MediaError> {
        for n in [1.0001, 1.01, 1.1, 1.33, 1.0 + (2.0_f64 / 3.0).sqrt(), 3.0] {
            for b in [1e-4, 0.005, 0.0183, 0.3, 0.499] {
                let mu = mu_from_backscatter(n, b)?;
                assert!(mu > 3.0 && mu < 5.0, "n {n}, B {b}: mu {mu}");
                let again = backscatter_from_mu(n, mu)?;
                // mu - 3 is stored next to 3: its digits, not the formula, limit a tiny B.
                assert!((again / b - 1.0).abs() < 1e-11, "n {n}, B {b}: {again}");
            }
        }
        Ok(())
    }

    #[test]
    fn the_backscatter_limit_is_rayleigh() -> Result<(), MediaError> {
        let phase = FournierForand::new(1.1, 0.5 - 1e-12)?;
        for x in [0.0, 1e-3, 0.2, 0.5, 0.8, 1.0] {
            let cos_theta: f64 = 1.0 - 2.0 * x;
            let rayleigh = 3.0 * (1.0 + cos_theta * cos_theta) / (16.0 * PI);
            if x > 0.0 {
                assert!((phase.value(x) / rayleigh - 1.0).abs() < 1e-9, "x {x}");
            }
        }
        Ok(())
    }

    #[test]
    fn stays_positive_and_finite_everywhere() -> Result<(), MediaError> {
        let singular = 1.0 + (4.0_f64 / 3.0).sqrt();
        for n in [1.0 + 1e-9, 1.001, 1.1, 1.5, 1.816, 2.0, singular, 2.5, 10.0] {
            for b in [1e-9, 1e-4, 0.01, 0.2, 0.4999] {
                let phase = FournierForand::new(n, b)?;
                for step in 0..=2000 {
                    let x = (-690.0 * (1.0 - f64::from(step) / 2000.0).powi(3)).exp();
                    let p = phase.value(x);
                    assert!(p > 0.0 && p.is_finite(), "n {n}, B {b}, x {x}: {p}");
                }
            }
        }
        Ok(())
    }

    #[test]
    fn refuses_unusable_parameters_and_says_the_range() {
        let text = |n, b| FournierForand::new(n, b).map_err(|e| e.to_string());
        assert_eq!(
            text(1.0, 0.01),
            Err("n must be in (1, 10], got 1".to_owned())
        );
        assert_eq!(
            text(1.1, 0.5),
            Err("backscatter_fraction must be in (0, 0.5), got 0.5".to_owned())
        );
        for (n, b) in [(f64::NAN, 0.1), (1.1, f64::NAN), (1.1, 0.0), (1.1, -0.1)] {
            assert!(text(n, b).is_err(), "n {n}, B {b}");
        }
        for mu in [3.0, 5.0, f64::NAN] {
            let error = FournierForand::from_mu(1.1, mu).map_err(|e| e.to_string());
            assert_eq!(error, Err(format!("mu must be in (3, 5), got {mu}")));
        }
    }
}
