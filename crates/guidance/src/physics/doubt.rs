//! What a fitted water leaves open of a prediction.

use super::file::{FitNumbers, WaterNumbers};

/// Names of a channel's absorption and scattering in [`FitNumbers::names`].
const NAMES: [[&str; 2]; 3] = [["a_r", "b_r"], ["a_g", "b_g"], ["a_b", "b_b"]];

/// Errors of a fitted absorption and scattering, and of the lamps beside daylight, per channel.
///
/// Between the place that a target's detail is known from and the place of a prediction light goes some way more or less: absorption counts
/// on the way to the camera and, as far as lamps light the target, on the way there; scattering takes detail on the way to the
/// camera. To first order the logarithm of the contrast is off by the way times the error of the coefficient. Where a prediction has another share of
/// the lamps' light than the picture, it is off by that of the error of their level over daylight's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaterDoubt {
    /// Covariance of a and b, 1/m².
    covariance: [[[f64; 2]; 2]; 3],
    /// Relative error of the lamps' level over that of daylight.
    lamps: [f64; 3],
}

impl WaterDoubt {
    /// Of a fit of `water`.
    ///
    /// # Errors
    /// An error or a correlation is missing or is none; the message names the field, what it must be and what it is.
    pub(super) fn new(fit: &FitNumbers, water: &WaterNumbers) -> Result<Self, String> {
        let n = fit.names.len();
        if fit.correlation.len() != n || fit.correlation.iter().any(|row| row.len() != n) {
            let rows = fit.correlation.len();
            return Err(format!(
                "correlation must have as many rows and columns as names, {n}, got {rows} rows"
            ));
        }
        let mut covariance = [[[0.0; 2]; 2]; 3];
        for k in 0..3 {
            let relative = [fit.a_relative_error[k], fit.b_relative_error[k]];
            let values = [water.a_per_m[k], water.b_per_m[k]];
            for (name, error) in ["a", "b"].iter().zip(relative) {
                if !(error >= 0.0 && error.is_finite()) {
                    return Err(format!(
                        "{name}_relative_error[{k}] must be finite and >= 0, got {error}"
                    ));
                }
            }
            let place = |name: &str| {
                let found = fit.names.iter().position(|known| known == name);
                found.ok_or_else(|| format!("names must hold {name:?}"))
            };
            let [a, b] = NAMES[k];
            let between = fit.correlation[place(a)?][place(b)?];
            if !(-1.0..=1.0).contains(&between) {
                return Err(format!(
                    "correlation of {a} and {b} must be within [-1, 1], got {between}"
                ));
            }
            let errors = [0, 1].map(|i| relative[i] * values[i]);
            covariance[k] = [
                [errors[0].powi(2), between * errors[0] * errors[1]],
                [between * errors[0] * errors[1], errors[1].powi(2)],
            ];
        }
        let lamps = fit.daylight_gain_relative_error.unwrap_or_default();
        if let Some(k) = lamps.iter().position(|e| !(*e >= 0.0 && e.is_finite())) {
            return Err(format!(
                "daylight_gain_relative_error[{k}] must be finite and >= 0, got {}",
                lamps[k]
            ));
        }
        Ok(Self { covariance, lamps })
    }

    /// Standard error of the logarithm of a channel's contrast from `way_m` farther away than where the detail is known from, a share
    /// `lamps` of the target's light being lamps' where a share `lamps_here` is in the picture.
    pub(super) fn relative(&self, k: usize, way_m: f64, [lamps_here, lamps]: [f64; 2]) -> f64 {
        let ways = [(1.0 + lamps) * way_m, way_m];
        let mut variance = (self.lamps[k] * (lamps - lamps_here)).powi(2);
        for (row, along) in self.covariance[k].iter().zip(ways) {
            for (entry, across) in row.iter().zip(ways) {
                variance += along * entry * across;
            }
        }
        variance.max(0.0).sqrt()
    }
}
