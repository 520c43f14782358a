//! What is to be expected of the squared error of a denoised picture.
//!
//! Its variance follows from the difference of its halves: (F_a - F_b)²/4. Its bias is what both halves miss of the samples
//! alike: of the residuals F_a - A and F_b - B, which are independent, the product has the squared bias as its mean. The
//! noise of the samples is in it too and has a mean of zero; it is the less the coarser both are made. The finest octave at
//! which their product stands out of that noise tells of the bias in it and in all coarser ones.

use super::blur::boxed;
use super::selection::Chosen;

/// Standard errors by which bias stands out of the noise, in two octaves in a row and in one alone.
const SIGNIFICANT: [f64; 2] = [1.5, 3.0];
/// Share of the picture's squared mean that is added to a pixel's squared level, as in `film::error`.
const FLOOR: f64 = 1e-4;
/// Radius over which the map of the error is averaged, twice, pixels.
const MAP_RADIUS_PX: usize = 6;

/// The estimated error of a picture.
pub(super) struct ErrorEstimate {
    /// Relative squared error of the picture from noise, mean over pixels and channels.
    pub(super) variance: f64,
    /// The same from bias.
    pub(super) bias: f64,
    /// Squared error of every pixel, (W/(m² sr))², averaged over some pixels around it.
    pub(super) map: Vec<[f32; 3]>,
}

/// The error of the mean of the halves that are shown; `width` is the picture's.
pub(super) fn estimate(chosen: &Chosen, width: usize) -> ErrorEstimate {
    let fitted = &chosen.shown;
    let pixels = fitted[0].len();
    let mut map = vec![[0.0; 3]; pixels];
    let (mut variance, mut bias) = (0.0, 0.0);
    for k in 0..3 {
        let level = |i: usize| 0.5 * f64::from(fitted[0][i][k] + fitted[1][i][k]);
        let mean = (0..pixels).map(level).sum::<f64>() / pixels.max(1) as f64;
        let squares: Vec<f64> = (0..pixels)
            .map(|i| level(i).powi(2) + FLOOR * mean * mean)
            .collect();
        let spread: Vec<f32> = (0..pixels)
            .map(|i| 0.25 * (fitted[0][i][k] - fitted[1][i][k]).powi(2))
            .collect();
        let relative = |i: usize, value: f64| {
            if squares[i] > 0.0 {
                value / squares[i]
            } else {
                0.0
            }
        };
        let of_noise = (0..pixels)
            .map(|i| relative(i, f64::from(spread[i])))
            .sum::<f64>();
        let residuals = [0, 1].map(|half| {
            let of = |i: usize| {
                relative(
                    i,
                    f64::from(chosen.residuals[half][i][k]) * squares[i].sqrt(),
                )
            };
            (0..pixels).map(of).collect::<Vec<f64>>()
        });
        let of_bias = common_square(residuals, width, of_noise / pixels.max(1) as f64);
        variance += of_noise / (3 * pixels.max(1)) as f64;
        bias += of_bias / 3.0;
        let smooth = (0..2).fold(spread, |plane, _| boxed(&plane, width, MAP_RADIUS_PX));
        for (i, pixel) in map.iter_mut().enumerate() {
            pixel[k] = smooth[i] + (of_bias * squares[i]) as f32;
        }
    }
    ErrorEstimate {
        variance,
        bias,
        map,
    }
}

/// Mean square of what two planes have in common, but for what is finer than what stands out of the noise; `variance` is that of
/// what they were taken off. In octaves whose noise is larger, chance would say of a good fit that it is a bad one: there bias has to
/// stand out farther.
fn common_square(mut planes: [Vec<f64>; 2], mut width: usize, variance: f64) -> f64 {
    let stands_out = |(mean, error): (f64, f64), errors: f64| mean > errors * error;
    let [twice, alone] = SIGNIFICANT;
    let mut product = mean_product(&planes);
    loop {
        let height = planes[0].len() / width.max(1);
        if width < 2 || height < 2 {
            return product.0.max(0.0);
        }
        planes = planes.map(|plane| halved(&plane, width));
        width /= 2;
        let coarser = mean_product(&planes);
        let in_two =
            product.1 < variance && stands_out(product, twice) && stands_out(coarser, twice);
        if in_two || stands_out(product, alone) {
            return product.0;
        }
        product = coarser;
    }
}

/// Mean product and its standard error.
fn mean_product([one, other]: &[Vec<f64>; 2]) -> (f64, f64) {
    let count = one.len().max(1) as f64;
    let products = || one.iter().zip(other).map(|(a, b)| a * b);
    let mean = products().sum::<f64>() / count;
    let squares = products().map(|p| (p - mean).powi(2)).sum::<f64>() / count;
    (mean, (squares / count).sqrt())
}

/// Means over squares of two pixels a side; what is left over at the right and at the bottom is left out.
fn halved(plane: &[f64], width: usize) -> Vec<f64> {
    let rows = plane.chunks_exact(2 * width);
    let of_rows = |rows: &[f64]| {
        let (above, below) = rows.split_at(width);
        let pairs = above.chunks_exact(2).zip(below.chunks_exact(2));
        pairs
            .map(|(a, b)| 0.25 * (a[0] + a[1] + b[0] + b[1]))
            .collect::<Vec<f64>>()
    };
    rows.flat_map(of_rows).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Rng;

    const WIDTH: usize = 128;
    const SEEDS: u32 = 40;

    /// Waves over `period_px` pixels with a mean square of 1.
    fn waves(period_px: f64) -> Vec<f64> {
        let wave = |i: usize| (std::f64::consts::TAU * i as f64 / period_px).sin();
        let pixel = |i: usize| 2.0 * wave(i % WIDTH) * wave(i / WIDTH);
        (0..WIDTH * WIDTH).map(pixel).collect()
    }

    /// Mean over seeds of the common square of a bias and noise of a standard deviation of 4.
    fn mean_found(bias: &[f64], variance: f64) -> f64 {
        let found = (0..SEEDS).map(|seed| {
            let planes = [0, 1].map(|half| {
                let mut rng = Rng::new(7, 2 * seed + half, 0, 0);
                let noisy = |b: &f64| b + 4.0 * 12_f64.sqrt() * (rng.uniform() - 0.5);
                bias.iter().map(noisy).collect()
            });
            common_square(planes, WIDTH, variance)
        });
        found.sum::<f64>() / f64::from(SEEDS)
    }

    /// Products of single pixels have a standard error of 0.125, so that a bias of 1 is seen at any scale, and none where there is none.
    #[test]
    fn what_halves_have_in_common_is_found_whatever_its_scale() {
        for period_px in [4.0, 16.0, 64.0] {
            let found = mean_found(&waves(period_px), 1.0);
            assert!((0.85..1.15).contains(&found), "{period_px} px: {found}");
        }
        let nothing = vec![0.0; WIDTH * WIDTH];
        let (by_noisy, by_good) = (mean_found(&nothing, 1.0), mean_found(&nothing, 0.01));
        assert!(by_noisy < 0.06, "of nothing: {by_noisy}");
        assert!(
            by_good < 0.5 * by_noisy,
            "of a good fit: {by_good} {by_noisy}"
        );
    }

    /// A bias of half the standard error of single pixels' products is seen once these are averaged; what chance adds is less.
    #[test]
    fn a_coarse_bias_is_found_below_the_noise_of_pixels() {
        let weak: Vec<f64> = waves(64.0).iter().map(|w| 0.25 * w).collect();
        let found = mean_found(&weak, 1.0);
        assert!((0.05..0.125).contains(&found), "{found}");
    }
}
