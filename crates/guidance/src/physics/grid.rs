//! Smooth functions over an image, by their values in the middles of the 10 × 6 patches.

use uw_calib::stats::{PATCH_COLUMNS, PATCH_ROWS};

/// Patches.
pub(crate) const PATCHES: usize = PATCH_COLUMNS * PATCH_ROWS;

/// Value at the image coordinates (`x`, `y`) in [0, 1] of a function given in the middles of patches; straight on beyond the
/// outermost ones.
pub(crate) fn at(values: &[f64], x: f64, y: f64) -> f64 {
    let cell = |at: f64, n: usize| {
        let position = at * n as f64 - 0.5;
        let before = (position.max(0.0) as usize).min(n - 2);
        (before, position - before as f64)
    };
    let ((column, s), (row, t)) = (cell(x, PATCH_COLUMNS), cell(y, PATCH_ROWS));
    let along = |row: usize| {
        let i = row * PATCH_COLUMNS + column;
        values[i] + s * (values[i + 1] - values[i])
    };
    let upper = along(row);
    upper + t * (along(row + 1) - upper)
}

/// Between two positive numbers by their logarithms, between others in a straight line.
pub(crate) fn between(from: f64, to: f64, share: f64) -> f64 {
    match from > 0.0 && to > 0.0 {
        true => from * (to / from).powf(share),
        false => from + share * (to - from),
    }
}

/// Variance that the slope of a function makes inside each patch: a twelfth of the squared steps along both sides.
pub(crate) fn slope_variance(values: &[f64]) -> [f64; PATCHES] {
    std::array::from_fn(|i| {
        let (row, column) = (i / PATCH_COLUMNS, i % PATCH_COLUMNS);
        let step = |at: usize, n: usize, stride: usize| {
            let (before, after) = (at.saturating_sub(1), (at + 1).min(n - 1));
            let base = i - at * stride;
            (values[base + after * stride] - values[base + before * stride])
                / (after - before) as f64
        };
        let across = step(column, PATCH_COLUMNS, 1);
        let down = step(row, PATCH_ROWS, PATCH_COLUMNS);
        (across * across + down * down) / 12.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(i: usize) -> f64 {
        2.0 + 0.5 * (i % PATCH_COLUMNS) as f64 - 0.25 * (i / PATCH_COLUMNS) as f64
    }

    #[test]
    fn planes_are_met_everywhere_and_their_slope_has_its_variance() {
        let values: Vec<f64> = (0..PATCHES).map(plane).collect();
        for (x, y) in [(0.0, 0.0), (0.5, 0.5), (0.33, 0.9), (1.0, 1.0)] {
            let expected = 2.0 + 0.5 * (10.0 * x - 0.5) - 0.25 * (6.0 * y - 0.5);
            assert!((at(&values, x, y) - expected).abs() < 1e-12, "{x} {y}");
        }
        for variance in slope_variance(&values) {
            assert!((variance - (0.25 + 0.0625) / 12.0).abs() < 1e-12);
        }
    }
}
