//! The target's blocks as cosines, so that each wave can be spread by what the water leaves of it.

use std::f64::consts::PI;

/// Cosines of a number of blocks across and down (discrete cosine transform, type II, orthonormal).
pub(super) struct Cosines {
    across: Vec<Vec<f64>>,
    /// What all cosines across have at each column.
    at_columns: Vec<Vec<f64>>,
    down: Vec<Vec<f64>>,
}

impl Cosines {
    pub(super) fn new([columns, rows]: [usize; 2]) -> Self {
        let across = basis(columns);
        let at = |column: usize| across.iter().map(|wave| wave[column]).collect();
        Self {
            at_columns: (0..columns).map(at).collect(),
            across,
            down: basis(rows),
        }
    }

    /// `values` (row by row) with each cosine multiplied by what is left of it (`left`, in the order of the cosines). Beyond the
    /// blocks the values go on mirrored.
    pub(super) fn spread(&self, values: &[f64], left: &[f64]) -> Vec<f64> {
        let (columns, rows) = (self.across.len(), self.down.len());
        let mut in_rows = vec![0.0; columns * rows];
        for (row, out) in values
            .chunks_exact(columns)
            .zip(in_rows.chunks_exact_mut(columns))
        {
            for (waves, value) in self.at_columns.iter().zip(row) {
                add(out, waves, *value);
            }
        }
        let mut waves = vec![0.0; columns * rows];
        for (v, wave) in self.down.iter().enumerate() {
            for (row, factor) in in_rows.chunks_exact(columns).zip(wave) {
                add(&mut waves[v * columns..][..columns], row, *factor);
            }
        }
        for (wave, left) in waves.iter_mut().zip(left) {
            *wave *= left;
        }
        let mut back = vec![0.0; columns * rows];
        for (v, wave) in self.down.iter().enumerate() {
            for (row, factor) in back.chunks_exact_mut(columns).zip(wave) {
                add(row, &waves[v * columns..][..columns], *factor);
            }
        }
        let mut spread = vec![0.0; columns * rows];
        for (row, out) in back
            .chunks_exact(columns)
            .zip(spread.chunks_exact_mut(columns))
        {
            for (amplitude, wave) in row.iter().zip(&self.across) {
                add(out, wave, *amplitude);
            }
        }
        spread
    }
}

fn basis(n: usize) -> Vec<Vec<f64>> {
    let wave = |i: usize| {
        let norm = (if i == 0 { 1.0 } else { 2.0 } / n as f64).sqrt();
        let at = move |j: usize| norm * (PI * i as f64 * (j as f64 + 0.5) / n as f64).cos();
        (0..n).map(at).collect()
    };
    (0..n).map(wave).collect()
}

fn add(to: &mut [f64], values: &[f64], factor: f64) {
    for (to, value) in to.iter_mut().zip(values) {
        *to += factor * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waves_keep_what_is_left_of_them() {
        let size = [10, 6];
        let cosines = Cosines::new(size);
        let wave = |i: usize, j: usize| -> Vec<f64> {
            let at =
                |c: usize, n: usize, i: usize| (PI * i as f64 * (c as f64 + 0.5) / n as f64).cos();
            (0..60)
                .map(|c| at(c % 10, 10, i) * at(c / 10, 6, j))
                .collect()
        };
        let (a, b) = (wave(3, 1), wave(0, 4));
        let mixed: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 2.0 + a + b).collect();
        let mut left = vec![1.0; 60];
        (left[13], left[40]) = (0.25, 0.5);
        let spread = cosines.spread(&mixed, &left);
        for ((a, b), found) in a.iter().zip(&b).zip(spread) {
            assert!((found - (2.0 + 0.25 * a + 0.5 * b)).abs() < 1e-12);
        }
    }
}
