//! Small least-squares problems by their normal equations.

use super::basis::MOST_TERMS;

/// Share of a term's square that must be left beside the terms before it; below it is one of them again and left out.
const LEAST_SHARE: f64 = 1e-5;

/// Sums of weighted products of terms with each other (upper triangle) and with values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    /// Weighted products of terms.
    pub(super) products: [[f64; MOST_TERMS]; MOST_TERMS],
    /// Weighted products of terms with values.
    pub(super) values: [f64; MOST_TERMS],
}

impl Moments {
    pub(super) const ZERO: Self = Self {
        products: [[0.0; MOST_TERMS]; MOST_TERMS],
        values: [0.0; MOST_TERMS],
    };

    /// Adds `terms` of weight `weight` whose `value` was seen.
    #[inline]
    pub(super) fn add(&mut self, terms: &[f64], weight: f64, value: f64) {
        for (i, term) in terms.iter().enumerate() {
            let weighted = weight * term;
            for (sum, other) in self.products[i][i..terms.len()].iter_mut().zip(&terms[i..]) {
                *sum += weighted * other;
            }
            self.values[i] += weighted * value;
        }
    }

    /// Adds `factor` times the moments of terms each of which is a sum of terms of `other`.
    pub(super) fn add_shifted(&mut self, other: &Self, factor: f64, parts: &[Vec<(usize, f64)>]) {
        let product = |a: usize, b: usize| other.products[a.min(b)][a.max(b)];
        for (i, own) in parts.iter().enumerate() {
            for (j, theirs) in parts.iter().enumerate().skip(i) {
                let mut sum = 0.0;
                for &(a, f) in own {
                    for &(b, g) in theirs {
                        sum += f * g * product(a, b);
                    }
                }
                self.products[i][j] += factor * sum;
            }
            let sum: f64 = own.iter().map(|&(a, f)| f * other.values[a]).sum();
            self.values[i] += factor * sum;
        }
    }

    /// The coefficients of `count` terms that fit the values best; terms that others make up have none.
    pub(super) fn solve(&self, count: usize) -> [f64; MOST_TERMS] {
        let mut factor = [[0.0; MOST_TERMS]; MOST_TERMS];
        let mut kept = [false; MOST_TERMS];
        for j in 0..count {
            for i in 0..=j {
                if i < j && !kept[i] {
                    continue;
                }
                let mut rest = self.products[i][j];
                for k in 0..i {
                    rest -= factor[i][k] * factor[j][k];
                }
                if i < j {
                    factor[j][i] = rest / factor[i][i];
                } else if rest > LEAST_SHARE * self.products[j][j] {
                    factor[j][j] = rest.sqrt();
                    kept[j] = true;
                } else {
                    factor[j] = [0.0; MOST_TERMS];
                }
            }
        }
        substitute(&factor, &kept, &self.values, count)
    }
}

/// Solves with the Cholesky factor of the terms that are kept.
fn substitute(
    factor: &[[f64; MOST_TERMS]; MOST_TERMS],
    kept: &[bool; MOST_TERMS],
    values: &[f64; MOST_TERMS],
    count: usize,
) -> [f64; MOST_TERMS] {
    let mut x = [0.0; MOST_TERMS];
    for i in (0..count).filter(|&i| kept[i]) {
        let sum: f64 = (0..i).map(|k| factor[i][k] * x[k]).sum();
        x[i] = (values[i] - sum) / factor[i][i];
    }
    for i in (0..count).rev().filter(|&i| kept[i]) {
        let sum: f64 = (i + 1..count).map(|k| factor[k][i] * x[k]).sum();
        x[i] = (x[i] - sum) / factor[i][i];
    }
    x
}
