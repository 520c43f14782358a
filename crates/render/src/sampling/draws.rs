//! The numbers one path uses: leading dimensions from a low-discrepancy sequence, the rest pseudorandom.

use super::{
    Rng,
    sobol::{DIMENSIONS, scrambled},
};

/// Number of leading dimensions: two on the pixel and five for the first choices of a path.
pub const LEADING: usize = DIMENSIONS;
/// Most samples in a batch.
pub const MAX_BATCH: u32 = 4096;

/// Draws of one path. Within a batch of samples of one pixel the leading numbers are the points of a scrambled Sobol
/// sequence, scrambled anew per pixel and batch: batches are independent and unbiased.
#[derive(Clone, Debug)]
pub struct Draws {
    scramble: u32,
    index: u32,
    seed: u64,
    pixel: u32,
    batch: u32,
    stream: u32,
    rng: Option<Rng>,
}

impl Draws {
    /// Draws of sample `index` of `batch` at `pixel`; `stream` separates the paths of one sample.
    pub fn new(seed: u64, pixel: u32, batch: u32, index: u32, stream: u32) -> Self {
        Self {
            scramble: Rng::new(seed, pixel, batch, 2 * stream).bits(),
            index,
            seed,
            pixel,
            batch,
            stream,
            rng: None,
        }
    }

    /// The draws of another sample of the same batch.
    pub fn at(&self, index: u32) -> Self {
        Self {
            index,
            rng: None,
            ..*self
        }
    }

    /// The number of the sample in its batch.
    pub fn index(&self) -> u32 {
        self.index
    }

    /// Leading number `dimension`, in (0, 1).
    #[inline]
    pub fn leading(&self, dimension: usize) -> f64 {
        scrambled(self.index, dimension, self.scramble)
    }

    /// The next pseudorandom number, in (0, 1).
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        let Self {
            seed,
            pixel,
            batch,
            index,
            stream,
            ..
        } = *self;
        self.rng
            .get_or_insert_with(|| {
                let sample = batch.wrapping_mul(MAX_BATCH).wrapping_add(index);
                Rng::new(seed ^ 0x5851_f42d_4c95_7f2d, pixel, sample, 2 * stream + 1)
            })
            .uniform()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leading_numbers_are_uniform_over_batches_and_stratified_within() {
        let mut sum = [0.0; LEADING];
        for batch in 0..4000 {
            for (d, s) in sum.iter_mut().enumerate() {
                *s += Draws::new(3, 11, batch, 5, 0).leading(d);
            }
        }
        assert!(
            sum.iter()
                .all(|s| (s / 4000.0 - 0.5).abs() < 4.0 * 0.2887 / 4000f64.sqrt())
        );
        // Sixteen points of one batch: the mean of each dimension is far closer to 1/2 than random points'.
        let spread = |d: usize| {
            let mean = |batch: u32| {
                (0..16)
                    .map(|i| Draws::new(3, 11, batch, i, 0).leading(d))
                    .sum::<f64>()
                    / 16.0
            };
            (0..200).map(|b| (mean(b) - 0.5).powi(2)).sum::<f64>() / 200.0
        };
        for d in 0..LEADING {
            assert!(
                spread(d) < 0.5 * (1.0 / 12.0 / 16.0),
                "dimension {d}: {}",
                spread(d)
            );
        }
    }
}
