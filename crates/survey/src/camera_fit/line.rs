//! The straight line of variance against signal, with rounding taken off.

use std::f64::consts::PI;

use uw_calib::response::LinearNoise;

use super::bins::Bin;

/// Rounds in which weights and line settle.
const ROUNDS: usize = 12;
/// Terms of the sum for rounding; the next is below 1e-3 of a squared count.
const TERMS: usize = 20;

/// A line with its errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    /// a and b.
    pub noise: LinearNoise,
    /// Their standard errors.
    pub errors: [f64; 2],
    /// Mean square of what the bins are off the line, in units of their errors.
    pub misfit: f64,
    /// Least noise of a bin in counts, standard deviation.
    pub least_counts: f64,
}

/// A bin's mean signal and variance without rounding.
struct Point {
    signal: f64,
    variance: f64,
    squared_error: f64,
    count: f64,
    count_square: f64,
}

/// The line through the bins, a and b at least 0; `correlated` is by how much neighbours that are alike raise the squared errors.
/// `None` where the bins have fewer than two signals.
pub(super) fn through<'a>(bins: impl Iterator<Item = &'a Bin>, correlated: f64) -> Option<Line> {
    let points: Vec<Point> = bins.map(|bin| point(bin, correlated)).collect();
    let mut noise = LinearNoise::default();
    let mut weights: Vec<f64> = points.iter().map(|p| p.count).collect();
    for _ in 0..ROUNDS {
        noise = positive(&points, &weights)?;
        // By the line's variances: those of the bins would draw it to what is small by chance.
        for (weight, point) in weights.iter_mut().zip(&points) {
            let without = noise.standard_deviation(point.signal).powi(2);
            let (with, steepness) = rounded(without, point.count_square);
            *weight = point.count * (steepness / with.max(f64::MIN_POSITIVE)).powi(2);
        }
    }
    let (_, inverse) = solve(&points, &weights)?;
    let off = |p: &Point| p.variance - noise.a * p.signal - noise.b;
    let squares = points.iter().map(|p| off(p).powi(2) / p.squared_error);
    let misfit = squares.sum::<f64>() / (points.len() as f64 - 2.0).max(1.0);
    let errors = errors(&points, &weights, inverse).map(|error| error * misfit.max(1.0).sqrt());
    let counts = |p: &Point| (p.variance / p.count_square).sqrt();
    Some(Line {
        noise,
        errors,
        misfit,
        least_counts: points.iter().map(counts).fold(f64::MAX, f64::min),
    })
}

fn point(bin: &Bin, correlated: f64) -> Point {
    let count_square = bin.count_square();
    let variance = without_rounding(bin.variance(), count_square);
    let (_, steepness) = rounded(variance, count_square);
    Point {
        signal: bin.mean(),
        variance,
        squared_error: (bin.squared_error() * correlated / (steepness * steepness))
            .max(f64::MIN_POSITIVE),
        count: bin.count,
        count_square,
    }
}

/// Variance with rounding of a variance without, and its derivative, where a count is worth the root of `count_square` and the
/// picture's levels fall anywhere between counts.
///
/// The error of rounding has 1/12 of a squared count; what two frames have in common of it, sum of exp(-4π²k²s²)/(2π²k²) over k
/// at a noise of s counts, does not show in their difference (Fourier series of the sawtooth).
fn rounded(variance: f64, count_square: f64) -> (f64, f64) {
    let z = variance / count_square;
    let (mut shared, mut slope) = (0.0, 0.0);
    for k in 1..=TERMS {
        let k2 = (k * k) as f64;
        let term = (-4.0 * PI * PI * k2 * z).exp();
        shared += term / (2.0 * PI * PI * k2);
        slope += 2.0 * term;
    }
    // The terms that are left out, at no noise: 1/12 less the sum up to TERMS.
    let with = z + (1.0 / 12.0 - shared).max(0.0);
    (with * count_square, 1.0 + slope)
}

/// The inverse of [`rounded`], by halving.
fn without_rounding(variance: f64, count_square: f64) -> f64 {
    let (mut low, mut high) = (0.0, variance);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match rounded(middle, count_square).0 < variance {
            true => low = middle,
            false => high = middle,
        }
    }
    0.5 * (low + high)
}

/// The weighted line with a and b at least 0.
fn positive(points: &[Point], weights: &[f64]) -> Option<LinearNoise> {
    let ([a, b], _) = solve(points, weights)?;
    let sum = |of: fn(&Point) -> f64| {
        let terms = points.iter().zip(weights);
        terms.map(|(p, w)| w * of(p)).sum::<f64>()
    };
    Some(if b < 0.0 {
        LinearNoise {
            a: sum(|p| p.signal * p.variance) / sum(|p| p.signal * p.signal),
            b: 0.0,
        }
    } else if a < 0.0 {
        LinearNoise {
            a: 0.0,
            b: sum(|p| p.variance) / sum(|_| 1.0),
        }
    } else {
        LinearNoise { a, b }
    })
}

/// The weighted line without bounds, and the inverse of its normal matrix: of a, of both, of b.
fn solve(points: &[Point], weights: &[f64]) -> Option<([f64; 2], [f64; 3])> {
    let mut sums = [0.0; 5];
    for (p, w) in points.iter().zip(weights) {
        let terms = [
            p.signal * p.signal,
            p.signal,
            1.0,
            p.signal * p.variance,
            p.variance,
        ];
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum += w * term;
        }
    }
    let [xx, x, one, xv, v] = sums;
    let determinant = xx * one - x * x;
    if determinant.is_nan() || determinant <= 1e-9 * xx * one {
        return None;
    }
    let inverse = [one, -x, xx].map(|entry| entry / determinant);
    let line = [
        inverse[0] * xv + inverse[1] * v,
        inverse[1] * xv + inverse[2] * v,
    ];
    Some((line, inverse))
}

/// Standard errors of a and b from those of the points, whatever the weights.
fn errors(points: &[Point], weights: &[f64], inverse: [f64; 3]) -> [f64; 2] {
    let mut squares = [0.0; 2];
    for (p, w) in points.iter().zip(weights) {
        let pull = [
            inverse[0] * p.signal + inverse[1],
            inverse[1] * p.signal + inverse[2],
        ];
        for (square, pull) in squares.iter_mut().zip(pull) {
            *square += (w * pull).powi(2) * p.squared_error;
        }
    }
    squares.map(f64::sqrt)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half the mean squared difference of two rounded numbers, by counting.
    #[test]
    fn rounding_adds_what_counting_finds() {
        for deviation in [0.05, 0.15, 0.3, 0.6, 2.0] {
            let steps = 400;
            let mut sum = 0.0;
            for i in 0..steps {
                let level = (f64::from(i) + 0.5) / f64::from(steps);
                let (mut mean, mut square, mut total) = (0.0, 0.0, 0.0);
                for j in -2000..=2000 {
                    let x = f64::from(j) / 2000.0 * 6.0;
                    let weight = (-0.5 * x * x).exp();
                    let count = (level + deviation * x).round();
                    mean += weight * count;
                    square += weight * count * count;
                    total += weight;
                }
                mean /= total;
                sum += square / total - mean * mean;
            }
            let counted = sum / f64::from(steps);
            let (with, _) = rounded(deviation * deviation, 1.0);
            // The series ends after 20 terms: 2.5e-3 of a squared count are missing where there is no noise at all.
            assert!(
                (with - counted).abs() < 3e-3,
                "{deviation}: {with} {counted}"
            );
            let back = without_rounding(9.0 * with, 9.0);
            assert!((back / (9.0 * deviation * deviation) - 1.0).abs() < 1e-6);
        }
    }
}
