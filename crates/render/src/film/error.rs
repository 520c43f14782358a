//! The estimated error of a picture: the variance of its pixels' means over their levels.
//!
//! A pixel's own mean is no measure of its level where it is noisy: of a bright sample that few pixels have, it rises
//! with the variance, and their ratio never passes 1. So the level is drawn from the pixel's mean to that of the other
//! pixels of its tile, by the share of noise in what they differ by (empirical Bayes, Efron and Morris 1973). With ever
//! more samples it becomes the pixel's mean.

use rayon::prelude::*;
use uw_media::Spectrum;

use super::{Film, FilmLayer, Row};

/// Edge of the tiles, pixels. Twin: shaders/kernels/statistics.wgsl.
const TILE: usize = 8;
/// Share of the picture's squared mean that is added to a pixel's squared level, so that dark pixels do not rule.
const FLOOR: f64 = 1e-4;

/// Fewest samples of a pixel whose spread tells of more than itself: of two, the estimate is 14 % low where rare samples
/// are bright (target at 15 m in clear water).
pub(crate) const FEWEST_SAMPLES: u64 = 4;

/// What the pixels of a tile have in common, in one channel.
struct Tile {
    pixels: f64,
    mean: f64,
    variance: f64,
    /// Sum of squared deviations from the mean.
    deviations: f64,
}

impl Film {
    /// Estimated relative error of the picture, sqrt(mean(variance of the pixel mean / (level² + 1e-4·mean²))) over
    /// pixels and channels; `None` before every row has two batches and four samples, 0 for a black picture.
    pub fn relative_error(&self) -> Option<f64> {
        let known = |r: &Row| r.batches >= 2 && r.samples >= FEWEST_SAMPLES;
        if !self.rows.iter().all(known) {
            return None;
        }
        let floor = self.mean().map(|mean| FLOOR * mean * mean);
        let total = self.layer(FilmLayer::Total);
        let variance = self.layer(FilmLayer::Variance);
        let width = (self.width as usize).max(1);
        let bands = total.par_chunks(TILE * width);
        let sums: Vec<f64> = bands
            .zip(variance.par_chunks(TILE * width))
            .map(|(total, variance)| relative_variance(total, variance, width, floor))
            .collect();
        Some((sums.iter().sum::<f64>() / (3.0 * total.len() as f64)).sqrt())
    }
}

/// Sum of variance over squared level in a band of tiles.
fn relative_variance(
    total: &[Spectrum],
    variance: &[Spectrum],
    width: usize,
    floor: Spectrum,
) -> f64 {
    let mut sum = 0.0;
    for left in (0..width).step_by(TILE) {
        let columns = left..(left + TILE).min(width);
        for k in 0..3 {
            let pixels = || {
                let rows = total.chunks(width).zip(variance.chunks(width));
                rows.flat_map(|(t, v)| t[columns.clone()].iter().zip(&v[columns.clone()]))
                    .map(|(t, v)| (t[k], v[k]))
            };
            let tile = Tile::of(pixels);
            for (mean, variance) in pixels() {
                let level = tile.level(mean, variance);
                let square = level * level + floor[k];
                if square > 0.0 {
                    sum += variance / square;
                }
            }
        }
    }
    sum
}

impl Tile {
    /// Of means and their variances.
    fn of<I: Iterator<Item = (f64, f64)>>(pixels: impl Fn() -> I) -> Self {
        let (mut count, mut means, mut variances) = (0.0, 0.0, 0.0);
        for (mean, variance) in pixels() {
            count += 1.0;
            means += mean;
            variances += variance;
        }
        let mean = means / count;
        Self {
            pixels: count,
            mean,
            variance: variances / count,
            deviations: pixels().map(|(x, _)| (x - mean).powi(2)).sum(),
        }
    }

    /// Level of a pixel with this mean and variance of the mean.
    fn level(&self, mean: f64, variance: f64) -> f64 {
        let others = self.pixels - 1.0;
        if others < 2.0 {
            return mean;
        }
        let deviation = mean - self.mean;
        // Mean, variance and spread of the others, without this pixel.
        let around = self.mean - deviation / others;
        let noise = self.variance + (self.variance - variance) / others;
        let deviations = self.deviations - deviation * deviation * self.pixels / others;
        let spread = (deviations / (others - 1.0) - noise).max(0.0);
        if spread + variance > 0.0 {
            around + spread / (spread + variance) * (mean - around)
        } else {
            mean
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::BatchMean;
    use crate::sampling::Rng;

    const SIZE_PX: u32 = 40;

    /// A film whose pixels have these levels; of `batches` samples one in `1 / chance` shines, the others are black.
    fn sparse(level: impl Fn(u32, u32) -> f64, chance: f64, batches: u32, seed: u64) -> Film {
        let mut film = Film::new(SIZE_PX, SIZE_PX, 0);
        let mut rng = Rng::new(seed, 0, 0, 0);
        for y in 0..SIZE_PX {
            let row = &mut film.rows[y as usize];
            for _ in 0..batches {
                for x in 0..SIZE_PX {
                    let shines = rng.uniform() < chance;
                    let light = if shines { level(x, y) / chance } else { 0.0 };
                    let batch = BatchMean::of_layers(&[[light; 3], [0.0; 3], [0.0; 3]], &[]);
                    row.add(x as usize, 0, &batch, 1);
                }
                row.finish_batch(1);
            }
        }
        film
    }

    /// Estimated over true error, each as the root of the mean square over seeds.
    fn ratio(level: impl Fn(u32, u32) -> f64 + Copy, chance: f64, batches: u32) -> f64 {
        const SEEDS: u64 = 20;
        let estimated = (0..SEEDS).map(|seed| {
            let error = sparse(level, chance, batches, seed).relative_error();
            error.expect("two batches").powi(2)
        });
        let true_square = (1.0 - chance) / (chance * f64::from(batches));
        (estimated.sum::<f64>() / SEEDS as f64 / true_square).sqrt()
    }

    /// The variance of a sample of such pixels is (1 − p)/p of their squared level. Judged by their own means, of whose
    /// square the estimated variance of a mean is 1 at most, the error of four batches was 0.7 of the true one.
    #[test]
    fn the_error_of_sparse_light_is_the_true_one_from_four_samples_on() {
        for batches in [4, 16, 64] {
            let flat = ratio(|_, _| 0.3, 0.3, batches);
            let slope = ratio(|x, _| 0.1 + 0.01 * f64::from(x), 0.3, batches);
            assert!((flat - 1.0).abs() < 0.1, "{batches} batches: {flat}");
            assert!((slope - 1.0).abs() < 0.1, "{batches} batches: {slope}");
        }
    }

    /// Where noise is small the level is that of the pixel, whatever its neighbours show.
    #[test]
    fn with_little_noise_the_level_is_the_pixels_own() {
        let checks = ratio(|x, y| if (x + y) % 2 == 0 { 0.1 } else { 1.0 }, 0.999, 400);
        assert!((checks - 1.0).abs() < 0.1, "{checks}");
    }
}
