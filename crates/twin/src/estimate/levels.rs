//! A spread as a mixture of the blurred versions of a texture.

use std::f64::consts::TAU;

use super::pyramid::TexturePyramid;

/// Frequencies at which the spread is compared with the pyramid's levels.
const FREQUENCIES: usize = 20;
/// Steps of the fit of the levels' weights.
const FIT_STEPS: usize = 400;

/// Frequencies, cycles per metre, from far below the tile's to the finest the texture holds.
pub(super) fn frequencies(pyramid: &TexturePyramid) -> Vec<f64> {
    let finest = 0.5 / pyramid.texel_m();
    let coarsest = finest / 2f64.powi(pyramid.levels() as i32);
    let step = (finest / coarsest).powf(1.0 / (FREQUENCIES - 1) as f64);
    (0..FREQUENCIES)
        .map(|i| coarsest * step.powi(i as i32))
        .collect()
}

/// Weights >= 0 with sum 1 of the levels, whose blurs together come closest to `transfer` (least squares by
/// coordinate descent).
pub(super) fn fit_levels(
    pyramid: &TexturePyramid,
    frequencies: &[f64],
    transfer: &[f64],
) -> Vec<f32> {
    let n = pyramid.levels();
    // The mean's weight makes up the sum; its own transfer is 0.
    let columns: Vec<Vec<f64>> = (0..n - 1)
        .map(|level| {
            let blur = pyramid.blur_m(level);
            frequencies
                .iter()
                .map(|f| (-0.5 * (TAU * f * blur).powi(2)).exp())
                .collect()
        })
        .collect();
    let mut weights = vec![0.0; n - 1];
    let mut residual = transfer.to_vec();
    for _ in 0..FIT_STEPS {
        for (level, column) in columns.iter().enumerate() {
            let square: f64 = column.iter().map(|c| c * c).sum();
            let along: f64 = column.iter().zip(&residual).map(|(c, r)| c * r).sum();
            let others: f64 = weights.iter().sum::<f64>() - weights[level];
            let new = (weights[level] + along / square).clamp(0.0, (1.0 - others).max(0.0));
            let change = new - weights[level];
            weights[level] = new;
            residual
                .iter_mut()
                .zip(column)
                .for_each(|(r, c)| *r -= change * c);
        }
    }
    let rest = (1.0 - weights.iter().sum::<f64>()).max(0.0);
    weights.push(rest);
    weights.into_iter().map(|w| w as f32).collect()
}
