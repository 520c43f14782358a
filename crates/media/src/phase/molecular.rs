//! Scattering by molecules (Rayleigh) and the isotropic phase function.

use std::f64::consts::PI;

use super::PhaseFunction;
use super::solve::into_range;
use crate::error::{MediaError, check};

/// Rayleigh scattering of unpolarised light with depolarisation,
/// `p = 3 (1 + A cos²θ) / (4π (3 + A))`, `A = (1 - ρ)/(1 + ρ)` (Morel 1974; the same as Chandrasekhar's
/// `3 (1 + 3γ + (1 - γ) cos²θ) / (16π (1 + 2γ))` with `γ = ρ/(2 - ρ)`).
///
/// The depolarisation ratio ρ is the ratio of the two polarised intensities at 90° in unpolarised light:
/// 0 gives `3 (1 + cos²θ)/(16π)`, about 0.09 is Morel's pure water (`A = 0.835`), 1 is isotropic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rayleigh {
    depolarisation: f64,
    /// A in [0, 1].
    anisotropy: f64,
}

impl Rayleigh {
    /// Depolarisation ratio in [0, 1].
    pub fn new(depolarisation: f64) -> Result<Self, MediaError> {
        check(
            "depolarisation",
            depolarisation,
            "in [0, 1]",
            (0.0..=1.0).contains(&depolarisation),
        )?;
        Ok(Self {
            depolarisation,
            anisotropy: (1.0 - depolarisation) / (1.0 + depolarisation),
        })
    }

    /// The depolarisation ratio, in [0, 1].
    pub fn depolarisation(&self) -> f64 {
        self.depolarisation
    }
}

impl PhaseFunction for Rayleigh {
    fn value(&self, x: f64) -> f64 {
        let cos_theta = 1.0 - 2.0 * x.clamp(0.0, 1.0);
        let a = self.anisotropy;
        3.0 * (1.0 + a * cos_theta * cos_theta) / (4.0 * PI * (3.0 + a))
    }

    fn cdf(&self, x: f64) -> f64 {
        let x = x.clamp(0.0, 1.0);
        let a = self.anisotropy;
        x * (3.0 + a * (3.0 - 6.0 * x + 4.0 * x * x)) / (3.0 + a)
    }

    fn ccdf(&self, x: f64) -> f64 {
        self.cdf(1.0 - x)
    }

    fn mean_cosine(&self) -> f64 {
        0.0
    }
}

/// Scattering that is the same in all directions, `1/(4π)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Isotropic;

impl PhaseFunction for Isotropic {
    fn value(&self, _x: f64) -> f64 {
        0.25 / PI
    }

    fn cdf(&self, x: f64) -> f64 {
        x.clamp(0.0, 1.0)
    }

    fn ccdf(&self, x: f64) -> f64 {
        (1.0 - x).clamp(0.0, 1.0)
    }

    fn inverse_cdf(&self, u: f64) -> f64 {
        into_range(u)
    }

    fn inverse_ccdf(&self, v: f64) -> f64 {
        into_range(1.0 - v)
    }

    fn mean_cosine(&self) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depolarisation_spans_from_the_dipole_to_isotropic() -> Result<(), MediaError> {
        let dipole = Rayleigh::new(0.0)?;
        assert!((dipole.value(0.0) - 6.0 / (16.0 * PI)).abs() < 1e-15);
        assert!((dipole.value(0.5) - 3.0 / (16.0 * PI)).abs() < 1e-15);
        let isotropic = Rayleigh::new(1.0)?;
        assert!((isotropic.value(0.1) - 0.25 / PI).abs() < 1e-15);
        Ok(())
    }

    #[test]
    fn agrees_with_morels_pure_water() -> Result<(), MediaError> {
        // Morel 1974: p = 0.06225 (1 + 0.835 cos²θ), printed with four digits; ρ = 0.09.
        let water = Rayleigh::new(0.09)?;
        for x in [0.0, 0.2, 0.5, 0.9] {
            let cos_theta: f64 = 1.0 - 2.0 * x;
            let morel = 0.06225 * (1.0 + 0.835 * cos_theta * cos_theta);
            assert!((water.value(x) / morel - 1.0).abs() < 2e-4, "x {x}");
        }
        Ok(())
    }

    #[test]
    fn refuses_depolarisation_outside_its_range() {
        for value in [-0.1, 1.1, f64::NAN] {
            let error = Rayleigh::new(value).map_err(|e| e.to_string());
            assert_eq!(
                error,
                Err(format!("depolarisation must be in [0, 1], got {value}"))
            );
        }
    }
}
