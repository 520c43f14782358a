//! Normal equations of small least-squares fits.

/// Solution and inverse of a symmetric positive definite `matrix`, by Gauss-Jordan elimination with row pivots; `None` where it
/// is singular to rounding.
pub(super) fn solve(matrix: &[Vec<f64>], right: &[f64]) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
    let n = right.len();
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let unit = (0..n).map(|j| f64::from(u8::from(i == j)));
            matrix[i].iter().copied().chain(unit).collect()
        })
        .collect();
    let largest = (0..n).map(|i| matrix[i][i].abs()).fold(0.0, f64::max);
    for column in 0..n {
        let size = |row: &usize| rows[*row][column].abs();
        let pivot = (column..n).max_by(|a, b| size(a).total_cmp(&size(b)))?;
        // Not `<=`: what is no number is singular too.
        if !(rows[pivot][column].abs() > 1e-14 * largest) {
            return None;
        }
        rows.swap(column, pivot);
        let scale = rows[column][column];
        rows[column].iter_mut().for_each(|value| *value /= scale);
        let own = rows[column].clone();
        for (i, row) in rows.iter_mut().enumerate() {
            let factor = row[column];
            if i != column && factor != 0.0 {
                for (value, from) in row.iter_mut().zip(&own) {
                    *value -= factor * from;
                }
            }
        }
    }
    let inverse: Vec<Vec<f64>> = rows.into_iter().map(|row| row[n..].to_vec()).collect();
    let dot = |row: &Vec<f64>| row.iter().zip(right).map(|(a, b)| a * b).sum();
    Some((inverse.iter().map(dot).collect(), inverse))
}
