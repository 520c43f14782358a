//! Nonlinear least squares by the method of Levenberg and Marquardt (Marquardt 1963), with the covariance of what is found.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Iterations after which it is given up.
const MOST_ITERATIONS: usize = 60;
/// Change of the sum of squares that counts as none: of what is found that is a small part of the standard error.
const STILL: f64 = 0.001;
/// Damping to begin with, and the factor by which a good step lessens it or a bad one raises it.
const DAMPING: f64 = 1e-3;
const DAMPING_FACTOR: f64 = 6.0;
/// Damping beyond which no step is found.
const MOST_DAMPING: f64 = 1e8;

/// Largest change of a parameter in a step: parameters are logarithms or numbers well below 1.
const MOST_CHANGE: f64 = 0.7;

/// A residual in standard errors, and its derivatives by some of the parameters.
#[derive(Clone, Debug, Default)]
pub(super) struct Residual {
    pub(super) value: f64,
    /// (parameter, derivative).
    pub(super) slopes: Vec<(usize, f64)>,
}

/// What is found.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    pub(super) parameters: Vec<f64>,
    /// Sum of the squared residuals.
    pub(super) sum: f64,
    /// Inverse of the normal matrix.
    pub(super) covariance: DMatrix<f64>,
    /// Whether the last step changed next to nothing.
    pub(super) settled: bool,
}

/// Normal equations at a place.
struct Equations {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    sum: f64,
}

impl Equations {
    fn new(residuals: &[Residual], parameters: usize) -> Self {
        let mut matrix = DMatrix::zeros(parameters, parameters);
        let mut gradient = DVector::zeros(parameters);
        let mut sum = 0.0;
        for residual in residuals {
            sum += residual.value * residual.value;
            for &(i, slope) in &residual.slopes {
                gradient[i] += slope * residual.value;
                for &(j, other) in &residual.slopes {
                    matrix[(j, i)] += slope * other;
                }
            }
        }
        Self {
            matrix,
            gradient,
            sum,
        }
    }

    /// The step for a damping; `None` where the damped matrix is not positive.
    fn step(&self, damping: f64) -> Option<DVector<f64>> {
        let mut damped = self.matrix.clone();
        for i in 0..damped.nrows() {
            damped[(i, i)] *= 1.0 + damping;
        }
        let step = -Cholesky::new(damped)?.solve(&self.gradient);
        let most = step.amax();
        Some(if most > MOST_CHANGE {
            step * (MOST_CHANGE / most)
        } else {
            step
        })
    }
}

impl Solution {
    /// How far the parameters would be off, to first order, with the residuals' values `other` in the place of those of
    /// `residuals`.
    pub(super) fn shift(&self, residuals: &[Residual], other: &[f64]) -> DVector<f64> {
        let mut gradient = DVector::zeros(self.parameters.len());
        for (residual, other) in residuals.iter().zip(other) {
            for &(i, slope) in &residual.slopes {
                gradient[i] += slope * (other - residual.value);
            }
        }
        -(&self.covariance * gradient)
    }
}

/// The parameters at which the squares of `residuals` sum up to the least, from `start` on; `None` where the residuals do not
/// tell all parameters. `progress` is told every iteration and says whether to go on.
pub(super) fn minimise(
    start: Vec<f64>,
    residuals: impl Fn(&[f64]) -> Vec<Residual>,
    most_iterations: Option<usize>,
    mut progress: impl FnMut() -> bool,
) -> Option<Solution> {
    let mut parameters = start;
    let mut here = Equations::new(&residuals(&parameters), parameters.len());
    let (mut damping, mut settled) = (DAMPING, false);
    for _ in 0..most_iterations.unwrap_or(MOST_ITERATIONS) {
        if settled || damping > MOST_DAMPING || !progress() {
            break;
        }
        let step = here.step(damping)?;
        let tried: Vec<f64> = parameters.iter().zip(&step).map(|(p, s)| p + s).collect();
        let there = Equations::new(&residuals(&tried), tried.len());
        if there.sum < here.sum {
            settled = here.sum - there.sum < STILL;
            (parameters, here) = (tried, there);
            damping /= DAMPING_FACTOR;
        } else {
            // A sum that is no number is no better either.
            settled = there.sum - here.sum < STILL && damping < 1.0;
            damping *= DAMPING_FACTOR;
        }
    }
    Some(Solution {
        covariance: Cholesky::new(here.matrix.clone())?.inverse(),
        parameters,
        sum: here.sum,
        settled,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decays with a known answer, told with known errors.
    fn decay(amplitude: f64, rate: f64, error: f64) -> impl Fn(&[f64]) -> Vec<Residual> {
        move |at: &[f64]| {
            let residual = |i: u32| {
                let t = 0.2 * f64::from(i);
                let value = at[0] * (-at[1] * t).exp();
                Residual {
                    value: (value - amplitude * (-rate * t).exp()) / error,
                    slopes: vec![(0, value / at[0] / error), (1, -t * value / error)],
                }
            };
            (0..20).map(residual).collect()
        }
    }

    #[test]
    fn the_least_is_found_from_afar() {
        let found = minimise(vec![9.0, 0.05], decay(2.0, 0.7, 0.01), None, || true);
        let found = found.expect("a solution");
        assert!(found.settled && found.sum < 1e-3, "{}", found.sum);
        assert!((found.parameters[0] - 2.0).abs() < 1e-6);
        assert!((found.parameters[1] - 0.7).abs() < 1e-6);
    }

    /// Of a straight line through independent values the variances are known in closed form.
    #[test]
    fn errors_are_those_of_a_line() {
        let line = |at: &[f64]| {
            let residual = |i: u32| {
                let t = f64::from(i);
                Residual {
                    value: (at[0] + at[1] * t) / 0.5,
                    slopes: vec![(0, 2.0), (1, 2.0 * t)],
                }
            };
            (0..5).map(residual).collect()
        };
        let found = minimise(vec![1.0, 1.0], line, None, || true).expect("a solution");
        // σ²/Σ(t - t̄)² for the slope; Σ(t - t̄)² = 10.
        assert!((found.covariance[(1, 1)] - 0.025).abs() < 1e-12);
        assert!((found.covariance[(0, 0)] - 0.25 * (0.2 + 0.4)).abs() < 1e-12);
    }

    /// Shifting all values of a line shifts its offset alone.
    #[test]
    fn other_residuals_shift_what_is_found() {
        let line = |at: &[f64]| -> Vec<Residual> {
            let residual = |i: u32| Residual {
                value: at[0] + at[1] * f64::from(i),
                slopes: vec![(0, 1.0), (1, f64::from(i))],
            };
            (0..5).map(residual).collect()
        };
        let found = minimise(vec![1.0, 1.0], line, None, || true).expect("a solution");
        let residuals = line(&found.parameters);
        let other: Vec<f64> = residuals.iter().map(|r| r.value - 0.3).collect();
        let shift = found.shift(&residuals, &other);
        assert!(
            (shift[0] - 0.3).abs() < 1e-9 && shift[1].abs() < 1e-9,
            "{shift}"
        );
    }

    #[test]
    fn what_nothing_tells_has_no_solution() {
        let one = |at: &[f64]| {
            vec![Residual {
                value: at[0],
                slopes: vec![(0, 1.0)],
            }]
        };
        assert!(minimise(vec![1.0, 1.0], one, None, || true).is_none());
    }
}
