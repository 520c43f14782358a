//! Points of the unit circle by their share of a turn.

use std::f64::consts::FRAC_PI_2;

/// Terms of the series of sine and cosine of an eighth of a turn at most; what follows is below 1e-17.
const TERMS: usize = 9;
/// Coefficients of x^(2n + 1) of sin(π/2·x) and of x^(2n) of cos(π/2·x).
const SINE: [f64; TERMS] = series(1);
const COSINE: [f64; TERMS] = series(0);

/// (−1)^n (π/2)^m / m! with m = 2n + `odd`.
const fn series(odd: usize) -> [f64; TERMS] {
    let mut found = [0.0; TERMS];
    let mut term = if odd == 1 { FRAC_PI_2 } else { 1.0 };
    let mut n = 0;
    while n < TERMS {
        found[n] = term;
        let m = (2 * n + odd) as f64;
        term *= -FRAC_PI_2 * FRAC_PI_2 / ((m + 1.0) * (m + 2.0));
        n += 1;
    }
    found
}

/// Sine and cosine of 2π·`turns`, for `turns` in [0, 1], within 3e-16. A number of turns needs none of the library's
/// reduction to a circle.
#[inline]
pub fn circle(turns: f64) -> (f64, f64) {
    let quarters = 4.0 * turns;
    let nearest = (quarters + 0.5) as i32;
    let x = quarters - f64::from(nearest);
    let z = x * x;
    let (sine, cosine) = (x * sum(&SINE, z), sum(&COSINE, z));
    let (sine, cosine) = if nearest & 1 == 0 {
        (sine, cosine)
    } else {
        (cosine, -sine)
    };
    if nearest & 2 == 0 {
        (sine, cosine)
    } else {
        (-sine, -cosine)
    }
}

/// Σ c_n z^n, pairwise, so that sums do not wait for each other.
#[inline]
fn sum(c: &[f64; TERMS], z: f64) -> f64 {
    let z2 = z * z;
    let z4 = z2 * z2;
    let low = (c[0] + c[1] * z) + (c[2] + c[3] * z) * z2;
    let high = (c[4] + c[5] * z) + (c[6] + c[7] * z) * z2;
    low + (high + c[8] * z4) * z4
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn it_is_the_librarys_sine_and_cosine() {
        for i in 0..=1_000_000 {
            let turns = f64::from(i) * 1e-6;
            let (sine, cosine) = circle(turns);
            let (expected_sine, expected_cosine) = (TAU * turns).sin_cos();
            // The library's argument is rounded: by 6e-17 in the first eighth, by 4.4e-16 at the end of the circle.
            let allowed = if turns < 0.125 { 3e-16 } else { 7.5e-16 };
            assert!((sine - expected_sine).abs() < allowed, "{turns}: {sine}");
            assert!(
                (cosine - expected_cosine).abs() < allowed,
                "{turns}: {cosine}"
            );
        }
    }

    #[test]
    fn quarters_are_exact() {
        let quarters = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 1.0)];
        for (i, expected) in (0..).zip(quarters) {
            assert_eq!(circle(0.25 * f64::from(i)), expected);
        }
    }
}
