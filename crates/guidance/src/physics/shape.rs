//! How a target's values are spread over patches and in them.

use serde::{Deserialize, Deserializer, Serialize};
use uw_calib::stats::{PATCH_COLUMNS, PATCH_ROWS};

use super::cleared::Cleared;
use super::grid::PATCHES;

/// Values that stand for those of a patch.
const QUANTILES: usize = 9;
/// Share of a patch that each of them stands for: little at the ends, which full scale cuts off and an encoding bends most. Seven equal
/// shares, the same for all patches, leave contrast of ten targets up to 61 % too high where bright spots are clipped, seven of each
/// patch 18 %, these 2.6 % (`tools/patch_quantiles.py`).
const SHARES: [f64; QUANTILES] = [0.01, 0.04, 0.12, 0.2, 0.26, 0.2, 0.12, 0.04, 0.01];
/// Pixels of a patch from which they are taken, along each side, about.
const SAMPLES: usize = 16;
/// Least square of a quarter's deviation over that of the picture, and mean over the picture's: less is not told from none.
const LEAST_QUARTER: f64 = 0.01;

/// How values are spread: one channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shape {
    /// Per patch the mean over that of the picture.
    pub(super) means: Vec<f64>,
    /// Per patch the deviation over their root mean square.
    pub(super) deviations: Vec<f64>,
    /// Per patch.
    #[serde(deserialize_with = "of_any_version")]
    pub(super) quantiles: Vec<Quantiles>,
}

/// Deviations from a patch's mean over its deviation, rising, mean 0, mean square 1: each the mean of a share of the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Quantiles([f32; QUANTILES]);

/// Earlier files have one list of seven, of equal shares, for all patches.
fn of_any_version<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Quantiles>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Stored {
        Patches(Vec<Quantiles>),
        Pooled([f64; 7]),
    }
    Ok(match Stored::deserialize(deserializer)? {
        Stored::Patches(patches) => patches,
        Stored::Pooled(equal) => vec![Quantiles::new(&equal); PATCHES],
    })
}

impl Quantiles {
    /// Of rising values.
    fn new(sorted: &[f64]) -> Self {
        let mut up_to = 0.0;
        let mut sum = 0.0;
        let parts: [f64; QUANTILES] = std::array::from_fn(|i| {
            up_to += SHARES[i] * sorted.len() as f64;
            let before = sum;
            sum = sum_of_first(sorted, up_to);
            (sum - before) / (SHARES[i] * sorted.len() as f64)
        });
        let over = |of: &dyn Fn(f64) -> f64| -> f64 {
            parts
                .iter()
                .zip(SHARES)
                .map(|(&p, share)| share * of(p))
                .sum()
        };
        let mean = over(&|p| p);
        let deviation = over(&|p| (p - mean).powi(2)).sqrt();
        let scale = match deviation > 0.0 {
            true => 1.0 / deviation,
            false => 0.0,
        };
        Self(parts.map(|p| (1e3 * scale * (p - mean)).round() as f32 / 1e3))
    }

    /// Of a patch whose values are all the same: whatever it hides lies evenly.
    fn even() -> Self {
        Self::new(&[0, 1, 2, 3, 4, 5, 6, 7].map(f64::from))
    }

    /// Values and their shares.
    pub(super) fn with_shares(&self) -> impl Iterator<Item = (f64, f64)> {
        self.0.iter().map(|&z| f64::from(z)).zip(SHARES)
    }

    fn is_finite(&self) -> bool {
        self.0.iter().all(|z| z.is_finite())
    }
}

/// Sum of the first `count` values, the last of them in part.
fn sum_of_first(values: &[f64], count: f64) -> f64 {
    let whole = (count as usize).min(values.len());
    let part = values
        .get(whole)
        .map_or(0.0, |next| next * (count - whole as f64));
    values[..whole].iter().sum::<f64>() + part
}

/// The quantiles of each patch of `width_px` × `height_px` pixels.
pub(super) fn quantiles(
    cleared: &Cleared,
    (width_px, height_px): (usize, usize),
) -> Vec<Quantiles> {
    let step = |side: usize| (side / SAMPLES).max(1);
    let of_patch = |i: usize| {
        let (left, top) = (i % PATCH_COLUMNS * width_px, i / PATCH_COLUMNS * height_px);
        let row = |y: usize| {
            let from = y * cleared.width + left;
            cleared.values[from..from + width_px]
                .iter()
                .step_by(step(width_px))
        };
        let rows = (top..top + height_px).step_by(step(height_px));
        let mut values: Vec<f64> = rows.flat_map(row).copied().collect();
        values.sort_by(f64::total_cmp);
        match values.first() < values.last() {
            true => Quantiles::new(&values),
            false => Quantiles::even(),
        }
    };
    (0..PATCHES).map(of_patch).collect()
}

impl Shape {
    /// Whether it is of so many patches and all numbers are finite.
    pub(super) fn is_right(&self) -> bool {
        let of_patches =
            |list: &Vec<f64>| list.len() == PATCHES && list.iter().all(|v| v.is_finite());
        of_patches(&self.means)
            && of_patches(&self.deviations)
            && self.quantiles.len() == PATCHES
            && self.quantiles.iter().all(Quantiles::is_finite)
    }

    /// Standard deviation of the patches' means over that of the picture.
    pub(super) fn spread(&self) -> f64 {
        spread(&self.means)
    }

    /// Standard deviation of the patches' deviations over their mean.
    pub(super) fn unevenness(&self) -> f64 {
        spread(&self.deviations)
    }

    /// How much the quarters of the picture differ: the standard deviation of the logarithm of their contrast, as counts have it.
    pub(super) fn unlikeness(&self) -> f64 {
        let quarter = |q: usize| {
            let (columns, rows) = (PATCH_COLUMNS / 2, PATCH_ROWS / 2);
            let (mut square, mut mean) = (0.0, 0.0);
            for i in 0..columns * rows {
                let row = q / 2 * rows + i / columns;
                let patch = row * PATCH_COLUMNS + q % 2 * columns + i % columns;
                square += self.deviations[patch].powi(2);
                mean += self.means[patch];
            }
            let n = (columns * rows) as f64;
            (square / n).max(LEAST_QUARTER).sqrt().ln() - 0.5 * (mean / n).max(LEAST_QUARTER).ln()
        };
        let all = [0, 1, 2, 3].map(quarter);
        let mean = all.iter().sum::<f64>() / 4.0;
        (all.iter().map(|q| (q - mean).powi(2)).sum::<f64>() / 3.0).sqrt()
    }
}

/// Standard deviation over the mean; 0 of nothing.
fn spread(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = |value: &f64| (value - mean).powi(2);
    let deviation = (values.iter().map(square).sum::<f64>() / n).sqrt();
    match mean > 0.0 {
        true => deviation / mean,
        false => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::super::noise::{Noise, NoiseMap};
    use super::*;

    /// Deviation of values that are cut off at 1.
    fn cut(values: impl Iterator<Item = (f64, f64)>) -> f64 {
        let (mut mean, mut square) = (0.0, 0.0);
        for (value, share) in values {
            mean += share * value.min(1.0);
            square += share * value.min(1.0).powi(2);
        }
        (square - mean * mean).sqrt()
    }

    #[test]
    fn what_full_scale_cuts_off_is_told_by_the_quantiles_of_a_patch() {
        // Patches with a few bright spots beside patches of dark and bright halves, brighter from the left to the right.
        let rank = |x: usize, y: usize| (((x % 20 * 20 + y % 20) * 157 % 400) as f64 + 0.5) / 400.0;
        let value = |x: usize, y: usize| match (x / 20 + y / 20) % 2 {
            0 => 0.02 * (1 + x / 20) as f64 * (1.0 - 2.0 * rank(x, y).ln()),
            _ => 0.06 * (1 + x / 20) as f64 * (1.0 + (rank(x, y) * 2.0).floor()),
        };
        let (width, height) = (200, 120);
        let cleared = Cleared {
            width,
            height,
            values: (0..width * height)
                .map(|i| value(i % width, i / width))
                .collect(),
            noise: NoiseMap::even(Noise::default()),
            at_full: vec![false; width * height],
        };
        for (i, quantiles) in quantiles(&cleared, (20, 20)).iter().enumerate() {
            let (left, top) = (i % PATCH_COLUMNS * 20, i / PATCH_COLUMNS * 20);
            let own = || (0..400).map(|j| value(left + j % 20, top + j / 20));
            let mean = own().sum::<f64>() / 400.0;
            let deviation = (own().map(|v| (v - mean).powi(2)).sum::<f64>() / 400.0).sqrt();
            let truth = cut(own().map(|v| (v, 1.0 / 400.0)));
            let stand_ins = quantiles.with_shares();
            let found = cut(stand_ins.map(|(z, share)| (mean + deviation * z, share)));
            assert!((found / truth - 1.0).abs() < 0.06, "{i}: {found} {truth}");
        }
    }

    #[test]
    fn values_that_are_all_the_same_hide_even_ones() {
        let cleared = Cleared {
            width: 50,
            height: 30,
            values: vec![0.3; 1500],
            noise: NoiseMap::even(Noise::default()),
            at_full: vec![false; 1500],
        };
        let all = quantiles(&cleared, (5, 5));
        assert_eq!(all, vec![Quantiles::even(); PATCHES]);
        let square: f64 = all[0].with_shares().map(|(z, share)| share * z * z).sum();
        assert!((square - 1.0).abs() < 1e-3, "{square}");
    }

    #[test]
    fn shapes_of_earlier_files_are_read() {
        let ones = vec!["1.0"; PATCHES].join(",");
        let seven = "[-1.5,-1.0,-0.5,0.0,0.5,1.0,1.5]";
        let text = format!(r#"{{"means":[{ones}],"deviations":[{ones}],"quantiles":{seven}}}"#);
        let shape: Shape = serde_json::from_str(&text).unwrap();
        assert!(shape.is_right());
        let own: Vec<f64> = shape.quantiles[7].with_shares().map(|(z, _)| z).collect();
        // Two shares lie in the outermost seventh, of which the deviation is then 0.967.
        assert!(
            (own[0] + 1.551).abs() < 0.01 && (own[8] - 1.551).abs() < 0.01,
            "{own:?}"
        );
        assert_eq!(
            serde_json::from_str::<Shape>(&serde_json::to_string(&shape).unwrap()).unwrap(),
            shape
        );
    }
}
