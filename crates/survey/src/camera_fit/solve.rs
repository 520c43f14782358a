//! Normal equations of small least-squares fits.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Least pivot, over the largest diagonal element, of a matrix that is not singular to rounding.
const LEAST_PIVOT: f64 = 1e-14;

/// Solution and inverse of a symmetric positive definite `matrix`; `None` where it is singular to rounding.
pub(super) fn solve(matrix: &[Vec<f64>], right: &[f64]) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
    let n = right.len();
    let whole = DMatrix::from_fn(n, n, |i, j| matrix[i][j]);
    let largest = whole.diagonal().amax();
    let factors = Cholesky::new(whole)?;
    let pivots = factors.l_dirty().diagonal();
    // Not `<=`: what is no number is singular too.
    if !pivots
        .iter()
        .all(|pivot| pivot * pivot > LEAST_PIVOT * largest)
    {
        return None;
    }
    let solution = factors.solve(&DVector::from_column_slice(right));
    let inverse = factors.inverse();
    let rows = inverse.row_iter().map(|row| row.iter().copied().collect());
    Some((solution.iter().copied().collect(), rows.collect()))
}
