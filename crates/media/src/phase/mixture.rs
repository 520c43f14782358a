//! Weighted sums of phase functions.

use super::{Phase, PhaseFunction};
use crate::error::{MediaError, check};

/// `p = Σ w_i p_i` with weights that sum to 1; physically each weight is the share of that
/// constituent in the scattering coefficient.
#[derive(Clone, Debug, PartialEq)]
pub struct Mixture {
    parts: Vec<(f64, Phase)>,
}

impl Mixture {
    /// At least one part; weights finite and > 0, in any unit: they are divided by their sum.
    pub fn new(mut parts: Vec<(f64, Phase)>) -> Result<Self, MediaError> {
        check(
            "parts",
            parts.len() as f64,
            "a list of at least one {weight, phase}",
            !parts.is_empty(),
        )?;
        for (weight, _) in &parts {
            check(
                "weight",
                *weight,
                "finite and > 0",
                weight.is_finite() && *weight > 0.0,
            )?;
        }
        let sum: f64 = parts.iter().map(|(weight, _)| weight).sum();
        check("sum of the weights", sum, "finite", sum.is_finite())?;
        for (weight, _) in &mut parts {
            *weight /= sum;
        }
        Ok(Self { parts })
    }

    /// The parts with their normalised weights.
    pub fn parts(&self) -> &[(f64, Phase)] {
        &self.parts
    }

    fn weighted(&self, of: impl Fn(&Phase) -> f64) -> f64 {
        self.parts
            .iter()
            .map(|(weight, part)| weight * of(part))
            .sum()
    }
}

impl PhaseFunction for Mixture {
    fn value(&self, x: f64) -> f64 {
        self.weighted(|part| part.value(x))
    }

    fn cdf(&self, x: f64) -> f64 {
        self.weighted(|part| part.cdf(x)).min(1.0)
    }

    fn ccdf(&self, x: f64) -> f64 {
        self.weighted(|part| part.ccdf(x)).min(1.0)
    }

    fn mean_cosine(&self) -> f64 {
        self.weighted(|part| part.mean_cosine())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{HenyeyGreenstein, Rayleigh};
    use super::*;

    #[test]
    fn weights_are_shares_of_their_sum() -> Result<(), MediaError> {
        let hg = HenyeyGreenstein::new(0.9)?;
        let rayleigh = Rayleigh::new(0.0)?;
        let mix = Mixture::new(vec![
            (3.0, Phase::HenyeyGreenstein(hg)),
            (1.0, Phase::Rayleigh(rayleigh)),
        ])?;
        assert!((mix.mean_cosine() - 0.675).abs() < 1e-15);
        let expected = 0.75 * hg.value(0.3) + 0.25 * rayleigh.value(0.3);
        assert!((mix.value(0.3) - expected).abs() < 1e-15);
        Ok(())
    }

    #[test]
    fn refuses_no_parts_and_bad_weights() {
        assert!(Mixture::new(Vec::new()).is_err());
        for weight in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = Mixture::new(vec![(weight, Phase::Isotropic)]).map_err(|e| e.to_string());
            assert_eq!(
                error,
                Err(format!("weight must be finite and > 0, got {weight}"))
            );
        }
        assert!(Mixture::new(vec![(f64::MAX, Phase::Isotropic); 2]).is_err());
    }
}
