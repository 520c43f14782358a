//! Draine's phase function (Draine 2003, Astrophys. J. 598, 1017, equations 3 and 4).

use super::PhaseFunction;
use super::henyey_greenstein::HenyeyGreenstein;
use crate::error::{MediaError, check};

/// `p = HG(g) · (1 + α cos²θ) / (1 + α (1 + 2g²)/3)`.
///
/// `α = 0` is Henyey-Greenstein, `α = 1` Cornette and Shanks (1992), `g = 0, α = 1` Rayleigh.
/// With large α it is one half of the fits to Mie scattering of Jendersie and d'Eon (2023).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draine {
    g: f64,
    alpha: f64,
}

impl Draine {
    /// `g` in (-1, 1) and `alpha` >= 0; neither is the mean cosine.
    pub fn new(g: f64, alpha: f64) -> Result<Self, MediaError> {
        check("g", g, "in (-1, 1)", g > -1.0 && g < 1.0)?;
        check(
            "alpha",
            alpha,
            "finite and >= 0",
            alpha.is_finite() && alpha >= 0.0,
        )?;
        Ok(Self { g, alpha })
    }

    /// The parameters (g, alpha).
    pub fn parameters(&self) -> (f64, f64) {
        (self.g, self.alpha)
    }

    /// Mean of cos²θ under Henyey-Greenstein enters the normalisation, `1 + α (1 + 2g²)/3`.
    fn normalisation(&self) -> f64 {
        1.0 + self.alpha * (1.0 + 2.0 * self.g * self.g) / 3.0
    }

    fn cdf_at(&self, g: f64, x: f64, y: f64) -> f64 {
        let hg = HenyeyGreenstein::cdf_at(g, x, y);
        ((hg + self.alpha * second_moment(g, x, y)) / self.normalisation()).min(1.0)
    }
}

/// `∫ cos²θ dF` of Henyey-Greenstein from straight on to `x`, `y = 1 - x`.
///
/// The antiderivative is rational in the chord `q = sqrt(1 + g² - 2g cosθ)`, with g³ below the line;
/// rearranged so that these powers of g are divided out and g = 0 is no special case.
fn second_moment(g: f64, x: f64, y: f64) -> f64 {
    let cos_theta = y - x;
    let k = 1.0 + g * g;
    let q0 = 1.0 - g;
    let q = HenyeyGreenstein::chord(g, x, y);
    let r = q * q0;
    let rho = (2.0 * k * (1.0 + cos_theta) - 4.0 * g * cos_theta) / (k + r);
    let bracket = rho * rho / r + (rho * rho - 4.0 * cos_theta) / (3.0 * k);
    (1.0 - g) * (1.0 + g) * x / (2.0 * (q + q0)) * bracket
}

impl PhaseFunction for Draine {
    fn value(&self, x: f64) -> f64 {
        let x = x.clamp(0.0, 1.0);
        let cos_theta = 1.0 - 2.0 * x;
        HenyeyGreenstein::value_at(self.g, x) * (1.0 + self.alpha * cos_theta * cos_theta)
            / self.normalisation()
    }

    fn cdf(&self, x: f64) -> f64 {
        let x = x.clamp(0.0, 1.0);
        self.cdf_at(self.g, x, 1.0 - x)
    }

    fn ccdf(&self, x: f64) -> f64 {
        // Seen from behind the function is the one with -g.
        let x = x.clamp(0.0, 1.0);
        self.cdf_at(-self.g, 1.0 - x, x)
    }

    fn mean_cosine(&self) -> f64 {
        let g2 = self.g * self.g;
        self.g * (1.0 + self.alpha * (3.0 + 2.0 * g2) / 5.0) / self.normalisation()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{PhaseFunction, Rayleigh};
    use super::*;

    #[test]
    fn contains_rayleigh_and_henyey_greenstein() -> Result<(), MediaError> {
        let (as_rayleigh, rayleigh) = (Draine::new(0.0, 1.0)?, Rayleigh::new(0.0)?);
        let (as_hg, hg) = (Draine::new(0.8, 0.0)?, HenyeyGreenstein::new(0.8)?);
        for x in [0.0, 1e-9, 0.1, 0.5, 0.75, 1.0] {
            assert!((as_rayleigh.value(x) - rayleigh.value(x)).abs() < 1e-15);
            assert!((as_rayleigh.cdf(x) - rayleigh.cdf(x)).abs() < 1e-15);
            assert!((as_hg.value(x) - hg.value(x)).abs() < 1e-12);
            assert!((as_hg.ccdf(x) - hg.ccdf(x)).abs() < 1e-15);
        }
        Ok(())
    }

    #[test]
    fn refuses_unusable_parameters() {
        let text = |g, alpha| Draine::new(g, alpha).map_err(|e| e.to_string());
        assert_eq!(
            text(1.0, 1.0),
            Err("g must be in (-1, 1), got 1".to_owned())
        );
        assert_eq!(
            text(0.5, -1.0),
            Err("alpha must be finite and >= 0, got -1".to_owned())
        );
        assert!(text(0.5, f64::NAN).is_err());
    }
}
