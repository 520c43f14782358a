//! Small least-squares problems by their normal equations, those of all channels and halves side by side.

use super::basis::{Basis, MOST_TERMS};
use super::lanes::{Lanes, ZERO, add_product, add_scaled, product, take_product};

/// Share of a term's square that must be left beside the terms before it; below it is one of them again and left out.
const LEAST_SHARE: f64 = 1e-5;

/// How moments about one place are made of those about another: for each sum of the one the sums of the other and their factors.
pub(super) struct Recast {
    parts: Vec<(usize, f64)>,
    /// Where the parts of each sum end.
    ends: Vec<usize>,
}

/// Number of moments of as many terms: sums of weighted products, of each term those with itself and the terms after it, then that with
/// the values.
pub(super) const fn size(terms: usize) -> usize {
    terms * (terms + 3) / 2
}

/// Where the sums of a term begin.
const fn start(terms: usize, term: usize) -> usize {
    size(terms) - size(terms - term)
}

impl Recast {
    /// To cells in which (u, v) are `scale` times what they are in the others, and larger by `shift`; with the weight of these.
    pub(super) fn of(basis: &Basis, scale: f64, shift: (f64, f64), weight: f64) -> Self {
        let terms = basis.len();
        let mut of_terms = basis.recast(scale, shift);
        // The values stay what they are.
        of_terms.push(vec![(terms, 1.0)]);
        let (mut parts, mut ends) = (Vec::new(), Vec::new());
        for i in 0..terms {
            for others in &of_terms[i..] {
                for &(a, f) in &of_terms[i] {
                    for &(b, g) in others {
                        let sum = start(terms, a.min(b)) + a.abs_diff(b);
                        parts.push((sum, weight * f * g));
                    }
                }
                ends.push(parts.len());
            }
        }
        Self { parts, ends }
    }
}

/// Adds terms of weight `weight` whose values were seen to `moments`: `row` holds the terms and then the values.
#[inline]
pub(super) fn add(moments: &mut [Lanes], row: &[Lanes], weight: &Lanes) {
    let mut sums = moments;
    for (i, term) in row[..row.len() - 1].iter().enumerate() {
        let others = &row[i..];
        let (own, rest) = sums.split_at_mut(others.len());
        let weighted = product(weight, term);
        for (sum, other) in own.iter_mut().zip(others) {
            add_product(sum, &weighted, other);
        }
        sums = rest;
    }
}

/// Adds moments about another place.
pub(super) fn add_recast(moments: &mut [Lanes], other: &[Lanes], recast: &Recast) {
    let mut from = 0;
    for (sum, &end) in moments.iter_mut().zip(&recast.ends) {
        for &(part, factor) in &recast.parts[from..end] {
            add_scaled(sum, factor, &other[part]);
        }
        from = end;
    }
}

/// The coefficients of the first `count` of `terms` terms that fit the values best; terms that others make up have none. The moments
/// are used up.
pub(super) fn solve(moments: &mut [Lanes], terms: usize, count: usize) -> [Lanes; MOST_TERMS] {
    let mut squares = [ZERO; MOST_TERMS];
    for (i, square) in squares.iter_mut().enumerate().take(count) {
        *square = moments[start(terms, i)];
    }
    let mut inverses = [ZERO; MOST_TERMS];
    let mut left = &mut moments[..];
    for i in 0..count {
        let (row, rest) = left.split_at_mut(terms + 1 - i);
        for (lane, inverse) in inverses[i].iter_mut().enumerate() {
            *inverse = inverse_root(row[0][lane], squares[i][lane]);
        }
        for value in row.iter_mut() {
            *value = product(value, &inverses[i]);
        }
        let mut below = &mut *rest;
        for term in i + 1..count {
            let row = &row[term - i..];
            let (own, after) = below.split_at_mut(row.len());
            for (value, other) in own.iter_mut().zip(row) {
                take_product(value, &row[0], other);
            }
            below = after;
        }
        left = rest;
    }
    substitute(moments, &inverses, terms, count)
}

/// Solves with the triangle of the elimination, whose rows end in the values that are left.
fn substitute(
    triangle: &[Lanes],
    inverses: &[Lanes; MOST_TERMS],
    terms: usize,
    count: usize,
) -> [Lanes; MOST_TERMS] {
    let mut solution = [ZERO; MOST_TERMS];
    for i in (0..count).rev() {
        let row = &triangle[start(terms, i)..start(terms, i + 1)];
        let mut rest = row[terms - i];
        for (factor, known) in row[1..].iter().zip(&solution[i + 1..count]) {
            take_product(&mut rest, factor, known);
        }
        solution[i] = product(&rest, &inverses[i]);
    }
    solution
}

/// One over the root of what is left of a square; none of what others make up.
fn inverse_root(left: f64, square: f64) -> f64 {
    if left > LEAST_SHARE * square {
        1.0 / left.sqrt()
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::denoise::lanes::lanes;

    /// Numbers in no order.
    fn numbers(seed: usize) -> Lanes {
        lanes(|k, half| (((seed * 7 + k * 3 + half) as f64).powi(2) * 0.7133).sin())
    }

    #[test]
    fn the_coefficients_come_back_and_what_others_make_up_has_none() {
        const TERMS: usize = 4;
        let wanted = |term: usize| numbers(100 + term);
        let mut moments = vec![ZERO; size(TERMS)];
        for i in 0..50 {
            let mut row = [
                numbers(3 * i),
                numbers(3 * i + 1),
                ZERO,
                numbers(3 * i + 2),
                ZERO,
            ];
            // The third is the first again.
            row[2] = row[0];
            for term in [0, 1, 3] {
                let own = row[term];
                add_product(&mut row[TERMS], &own, &wanted(term));
            }
            add(&mut moments, &row, &[1.5; 6]);
        }
        let found = solve(&mut moments, TERMS, TERMS);
        for term in [0, 1, 3] {
            for (found, wanted) in found[term].iter().zip(wanted(term)) {
                assert!((found - wanted).abs() < 1e-9, "{term}: {found} {wanted}");
            }
        }
        assert_eq!(found[2], ZERO);
    }
}
