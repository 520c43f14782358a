//! What is to be expected of the squared error of a denoised picture.
//!
//! Its variance follows from the difference of its halves: (F_a - F_b)²/4. Its bias is what both halves miss of the samples
//! alike: of the residuals F_a - A and F_b - B, which are independent, the product has the squared bias as its mean. The
//! noise of the samples is in it too and has a mean of zero; so products are summed octave by octave, and an octave counts
//! only where it stands out of that noise.

use super::blur::boxed;
use super::selection::Chosen;

/// Standard errors above which an octave of the bias counts.
const SIGNIFICANT: f64 = 2.0;
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
        let of_bias = common_square(residuals, width);
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

/// Mean square of what two planes have in common.
fn common_square(mut planes: [Vec<f64>; 2], mut width: usize) -> f64 {
    let mut sum = 0.0;
    loop {
        let (mean, error) = mean_product(&planes);
        let height = planes[0].len() / width.max(1);
        if width < 2 || height < 2 {
            return sum + mean.max(0.0);
        }
        planes = planes.map(|plane| halved(&plane, width));
        width /= 2;
        let octave = mean - mean_product(&planes).0;
        if octave > SIGNIFICANT * error {
            sum += octave;
        }
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
