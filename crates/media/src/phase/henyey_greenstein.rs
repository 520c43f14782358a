//! Henyey-Greenstein phase function (Henyey & Greenstein 1941, Astrophys. J. 93, 70).

use std::f64::consts::PI;

use super::PhaseFunction;
use super::solve::into_range;
use crate::error::{MediaError, check};

/// `p = (1 - g²) / (4π (1 + g² - 2g cosθ)^(3/2))`, cosθ between the directions of travel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HenyeyGreenstein {
    g: f64,
}

impl HenyeyGreenstein {
    /// Mean cosine `g` in (-1, 1); positive goes on, negative comes back.
    pub fn new(g: f64) -> Result<Self, MediaError> {
        check("g", g, "in (-1, 1)", g > -1.0 && g < 1.0)?;
        Ok(Self { g })
    }

    /// The parameter g, in (-1, 1).
    pub fn g(&self) -> f64 {
        self.g
    }

    /// `sqrt(1 + g² - 2g cosθ)` at `x` with `y = 1 - x`, as a sum of positive terms for either sign of `g`.
    pub(super) fn chord(g: f64, x: f64, y: f64) -> f64 {
        if g >= 0.0 {
            ((1.0 - g) * (1.0 - g) + 4.0 * g * x).sqrt()
        } else {
            ((1.0 + g) * (1.0 + g) - 4.0 * g * y).sqrt()
        }
    }

    /// Value for any `g` in (-1, 1), 1/sr.
    pub(super) fn value_at(g: f64, x: f64) -> f64 {
        let chord = Self::chord(g, x, 1.0 - x);
        (1.0 - g) * (1.0 + g) / (4.0 * PI * chord * chord * chord)
    }

    /// CDF for any `g` in (-1, 1) at `x` with `y = 1 - x`. With `-g` and `x`, `y` exchanged it is the complement.
    pub(super) fn cdf_at(g: f64, x: f64, y: f64) -> f64 {
        let chord = Self::chord(g, x, y);
        2.0 * (1.0 + g) * x / (chord * (chord + (1.0 - g)))
    }

    /// Inverse of [`HenyeyGreenstein::cdf_at`].
    fn inverse_at(g: f64, u: f64) -> f64 {
        let u = u.clamp(0.0, 1.0);
        let d = if g >= 0.0 {
            1.0 - g + 2.0 * g * (1.0 - u)
        } else {
            1.0 + g - 2.0 * g * u
        };
        0.5 * u * ((1.0 - g) / d).powi(2) * (1.0 + g + d)
    }
}

impl PhaseFunction for HenyeyGreenstein {
    fn value(&self, x: f64) -> f64 {
        Self::value_at(self.g, x.clamp(0.0, 1.0))
    }

    fn cdf(&self, x: f64) -> f64 {
        let x = x.clamp(0.0, 1.0);
        Self::cdf_at(self.g, x, 1.0 - x).min(1.0)
    }

    fn ccdf(&self, x: f64) -> f64 {
        let x = x.clamp(0.0, 1.0);
        Self::cdf_at(-self.g, 1.0 - x, x).min(1.0)
    }

    fn inverse_cdf(&self, u: f64) -> f64 {
        into_range(Self::inverse_at(self.g, u))
    }

    fn inverse_ccdf(&self, v: f64) -> f64 {
        into_range(1.0 - Self::inverse_at(-self.g, v))
    }

    fn mean_cosine(&self) -> f64 {
        self.g
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positive_g_goes_on_and_negative_comes_back() -> Result<(), MediaError> {
        for (g, going_on) in [(0.9, true), (-0.9, false)] {
            let phase = HenyeyGreenstein::new(g)?;
            assert_eq!(phase.inverse_cdf(0.5) < 0.1, going_on, "g {g}");
            assert_eq!(phase.inverse_cdf(0.5) < 0.9, going_on, "g {g}");
            assert_eq!(phase.cdf(0.25) > 0.9, going_on, "g {g}");
        }
        Ok(())
    }

    #[test]
    fn equals_the_textbook_form_in_the_cosine() -> Result<(), MediaError> {
        for g in [-0.7_f64, -1e-9, 0.0, 0.3, 0.924] {
            for x in [0.01, 0.2, 0.5, 0.99] {
                let cos_theta = 1.0 - 2.0 * x;
                let textbook =
                    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos_theta).powf(1.5));
                let value = HenyeyGreenstein::new(g)?.value(x);
                assert!((value / textbook - 1.0).abs() < 1e-12, "g {g}, x {x}");
            }
        }
        Ok(())
    }

    #[test]
    fn refuses_g_outside_its_range() {
        for g in [-1.0, 1.0, 1.5, f64::NAN, f64::INFINITY] {
            let error = HenyeyGreenstein::new(g).map_err(|e| e.to_string());
            assert_eq!(error, Err(format!("g must be in (-1, 1), got {g}")));
        }
    }
}
