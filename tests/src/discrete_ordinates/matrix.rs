//! Square matrices, as much as the solver needs.

/// A square matrix, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    n: usize,
    rows: Vec<f64>,
}

impl Matrix {
    /// The matrix of `n` × `n` entries `entry(row, column)`.
    pub fn from_fn(n: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let rows = (0..n * n).map(|i| entry(i / n, i % n)).collect();
        Self { n, rows }
    }

    /// The product with `other` on the right.
    pub fn times(&self, other: &Self) -> Self {
        let n = self.n;
        let mut rows = vec![0.0; n * n];
        for (out, row) in rows.chunks_exact_mut(n).zip(self.rows.chunks_exact(n)) {
            for (factor, line) in row.iter().zip(other.rows.chunks_exact(n)) {
                for (sum, x) in out.iter_mut().zip(line) {
                    *sum += factor * x;
                }
            }
        }
        Self { n, rows }
    }

    /// The product with a vector on the right.
    pub fn apply(&self, vector: &[f64]) -> Vec<f64> {
        let line = |row: &[f64]| row.iter().zip(vector).map(|(a, x)| a * x).sum();
        self.rows.chunks_exact(self.n).map(line).collect()
    }

    /// The sum with `other`.
    pub fn plus(mut self, other: &Self) -> Self {
        for (sum, x) in self.rows.iter_mut().zip(&other.rows) {
            *sum += x;
        }
        self
    }

    /// (1 − self)⁻¹: the sum of all orders of reflection to and fro. Gauss-Jordan without pivoting, which the small
    /// entries of products of reflections allow.
    pub fn all_orders(&self) -> Self {
        let n = self.n;
        let unit = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let mut left = Self::from_fn(n, |i, j| unit(i, j) - self.rows[i * n + j]);
        let mut right = Self::from_fn(n, unit);
        for pivot in 0..n {
            let scale = 1.0 / left.rows[pivot * n + pivot];
            let scaled = |m: &Self| -> Vec<f64> {
                m.rows[pivot * n..(pivot + 1) * n]
                    .iter()
                    .map(|x| x * scale)
                    .collect()
            };
            let (left_line, right_line) = (scaled(&left), scaled(&right));
            for row in 0..n {
                let (factor, keep) = if row == pivot {
                    (-1.0, 0.0)
                } else {
                    (left.rows[row * n + pivot], 1.0)
                };
                for (m, line) in [(&mut left, &left_line), (&mut right, &right_line)] {
                    for (x, y) in m.rows[row * n..(row + 1) * n].iter_mut().zip(line) {
                        *x = keep * *x - factor * y;
                    }
                }
            }
        }
        right
    }
}

/// The sum of two vectors, the second one `factor` times.
pub fn sum(a: &[f64], factor: f64, b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + factor * b).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_orders_is_the_inverse_of_one_minus_the_matrix() {
        const N: usize = 7;
        let unit = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let entry = |i: usize, j: usize| ((3 * i + 5 * j * j) % 7) as f64 / 50.0;
        let inverse = Matrix::from_fn(N, entry).all_orders();
        let product = Matrix::from_fn(N, |i, j| unit(i, j) - entry(i, j)).times(&inverse);
        for (i, x) in product.rows.iter().enumerate() {
            assert!((x - unit(i / N, i % N)).abs() < 1e-12, "{i}: {x}");
        }
    }
}
