//! Smooth functions over the image.

/// Highest degree in either direction.
const MAX_DEGREE: usize = 8;

/// Products of Legendre polynomials in the image coordinates p (right) and q (down), both in [-1, 1].
///
/// Only even degrees of p: camera, lamps and sun are mirror-symmetric about the vertical plane of the view.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Basis {
    terms: Vec<(usize, usize)>,
}

impl Basis {
    /// All products up to a total `degree` of at most 8; `even_q` keeps even degrees of q only.
    pub fn new(degree: usize, even_q: bool) -> Self {
        let degree = degree.min(MAX_DEGREE);
        let step = if even_q { 2 } else { 1 };
        let terms = (0..=degree)
            .step_by(2)
            .flat_map(|i| (0..=degree - i).step_by(step).map(move |j| (i, j)))
            .collect();
        Self { terms }
    }

    /// Number of functions.
    pub fn len(&self) -> usize {
        self.terms.len()
    }

    /// Never: there is always the constant.
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// Values at (p, q), into `out` of length [`Basis::len`].
    pub fn values(&self, p: f64, q: f64, out: &mut [f64]) {
        let (in_p, in_q) = (legendre(p), legendre(q));
        for (value, &(i, j)) in out.iter_mut().zip(&self.terms) {
            *value = in_p[i] * in_q[j];
        }
    }

    /// The polynomial with `coefficients` along the row at `q`: its coefficients in p, to be used with
    /// [`Basis::along_row`].
    pub fn row(&self, coefficients: &[f64], q: f64) -> [f64; MAX_DEGREE + 1] {
        let in_q = legendre(q);
        let mut row = [0.0; MAX_DEGREE + 1];
        for (c, &(i, j)) in coefficients.iter().zip(&self.terms) {
            row[i] += c * in_q[j];
        }
        row
    }

    /// Value at `p` of a row's polynomial, given the Legendre polynomials at p.
    pub fn along_row(row: &[f64; MAX_DEGREE + 1], in_p: &[f64; MAX_DEGREE + 1]) -> f64 {
        // Only even degrees occur.
        row[0] + row[2] * in_p[2] + row[4] * in_p[4] + row[6] * in_p[6] + row[8] * in_p[8]
    }
}

/// Legendre polynomials P0 to P8 at `x`.
pub fn legendre(x: f64) -> [f64; MAX_DEGREE + 1] {
    let mut p = [1.0; MAX_DEGREE + 1];
    p[1] = x;
    for n in 1..MAX_DEGREE {
        let k = n as f64;
        p[n + 1] = ((2.0 * k + 1.0) * x * p[n] - k * p[n - 1]) / (k + 1.0);
    }
    p
}

/// Solves `matrix` · x = `right` in place by Gaussian elimination with pivoting; `None` where the matrix is
/// singular. The matrix is square, row by row.
pub fn solve(matrix: &mut [f64], right: &mut [f64]) -> Option<()> {
    let n = right.len();
    for column in 0..n {
        let pivot = (column..n).max_by(|&a, &b| {
            matrix[a * n + column]
                .abs()
                .total_cmp(&matrix[b * n + column].abs())
        })?;
        if !(matrix[pivot * n + column].abs() > 0.0) {
            return None;
        }
        if pivot != column {
            for k in 0..n {
                matrix.swap(pivot * n + k, column * n + k);
            }
            right.swap(pivot, column);
        }
        for row in column + 1..n {
            let factor = matrix[row * n + column] / matrix[column * n + column];
            for k in column..n {
                matrix[row * n + k] -= factor * matrix[column * n + k];
            }
            right[row] -= factor * right[column];
        }
    }
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|k| matrix[row * n + k] * right[k]).sum();
        right[row] = (right[row] - known) / matrix[row * n + row];
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_the_same_polynomial_as_the_values() {
        let basis = Basis::new(6, false);
        let coefficients: Vec<f64> = (0..basis.len()).map(|k| 0.3 * k as f64 - 1.0).collect();
        let mut values = vec![0.0; basis.len()];
        for (p, q) in [(0.0, 0.0), (0.7, -0.2), (-1.0, 1.0)] {
            basis.values(p, q, &mut values);
            let direct: f64 = values.iter().zip(&coefficients).map(|(v, c)| v * c).sum();
            let row = Basis::along_row(&basis.row(&coefficients, q), &legendre(p));
            assert!((direct - row).abs() < 1e-12, "{direct} {row}");
        }
        assert_eq!((basis.len(), Basis::new(6, true).len()), (16, 10));
    }

    #[test]
    fn systems_are_solved_also_when_the_first_pivot_is_zero() {
        let mut matrix = vec![0.0, 2.0, 1.0, 1.0, 1.0, 0.0, 3.0, 0.0, -1.0];
        let x = [2.0, -1.0, 0.5];
        let mut right: Vec<f64> = (0..3)
            .map(|r| (0..3).map(|k| matrix[r * 3 + k] * x[k]).sum())
            .collect();
        solve(&mut matrix, &mut right).expect("regular");
        assert!(right.iter().zip(x).all(|(a, b)| (a - b).abs() < 1e-12));
        assert!(solve(&mut [1.0, 2.0, 2.0, 4.0], &mut [1.0, 2.0]).is_none());
    }
}
