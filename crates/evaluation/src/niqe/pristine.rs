//! What the features of pristine natural images are.

use serde::Deserialize;

use super::FEATURES;
use crate::linear::solve;

/// Mean and covariance of the features over the blocks of pristine images.
#[derive(Clone, Debug, PartialEq)]
pub struct Pristine {
    mean: [f64; FEATURES],
    covariance: [[f64; FEATURES]; FEATURES],
}

/// The model of pristine images cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PristineError {
    /// Not JSON with the fields `mu` and `cov`.
    #[error("NIQE's model of pristine images: {0}")]
    Json(#[from] serde_json::Error),
    /// Another number of features.
    #[error(
        "NIQE's model of pristine images must have {FEATURES} features in mu and cov, got {got}"
    )]
    Size {
        /// Features found where they do not fit.
        got: usize,
    },
}

#[derive(Deserialize)]
struct File {
    mu: Vec<f64>,
    cov: Vec<Vec<f64>>,
}

impl Pristine {
    /// The model that its authors published (assets/niqe_pristine.json, notice in assets/niqe_LICENSE.txt).
    pub fn shipped() -> Result<Self, PristineError> {
        Self::parse(include_str!("../../assets/niqe_pristine.json"))
    }

    fn parse(text: &str) -> Result<Self, PristineError> {
        let file: File = serde_json::from_str(text)?;
        let row = |values: Vec<f64>| {
            <[f64; FEATURES]>::try_from(values)
                .map_err(|values| PristineError::Size { got: values.len() })
        };
        let rows = file
            .cov
            .into_iter()
            .map(row)
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            mean: row(file.mu)?,
            covariance: rows
                .try_into()
                .map_err(|rows: Vec<_>| PristineError::Size { got: rows.len() })?,
        })
    }

    /// sqrt((μ − μ')ᵀ ((Σ + Σ')/2)⁻¹ (μ − μ')) with the mean and covariance of `samples`; `None` with fewer than two.
    pub(super) fn distance(&self, samples: &[[f64; FEATURES]]) -> Option<f64> {
        if samples.len() < 2 {
            return None;
        }
        let n = samples.len() as f64;
        let mean: [f64; FEATURES] =
            std::array::from_fn(|i| samples.iter().map(|s| s[i]).sum::<f64>() / n);
        let covariance = |i: usize, j: usize| {
            let products = samples.iter().map(|s| (s[i] - mean[i]) * (s[j] - mean[j]));
            products.sum::<f64>() / (n - 1.0)
        };
        let pooled: [[f64; FEATURES]; FEATURES] = std::array::from_fn(|i| {
            std::array::from_fn(|j| 0.5 * (self.covariance[i][j] + covariance(i, j)))
        });
        let difference: [f64; FEATURES] = std::array::from_fn(|i| self.mean[i] - mean[i]);
        let solved = solve(&pooled, &difference)?;
        let squared: f64 = difference.iter().zip(&solved).map(|(a, b)| a * b).sum();
        Some(squared.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_of_another_size_is_refused() {
        let error = Pristine::parse(r#"{"mu": [1.0, 2.0], "cov": []}"#).expect_err("two features");
        assert!(error.to_string().contains("got 2"), "{error}");
    }
}
