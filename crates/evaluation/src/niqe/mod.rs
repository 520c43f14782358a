//! NIQE: how far the statistics of an image are from those of pristine natural images; lower is better.
//!
//! A. Mittal, R. Soundararajan, A. C. Bovik, *Making a "completely blind" image quality analyzer*, IEEE Signal
//! Processing Letters 20, 209-212 (2013). The image is cut into blocks; at two scales each block gives 18 parameters
//! of the distributions of its locally normalised values ([`aggd`]); the score is a distance between the normal
//! distribution of these 36 numbers over the blocks and the one of pristine images ([`pristine`]).

mod aggd;
mod pristine;
mod scale;

pub use pristine::{Pristine, PristineError};

use aggd::Aggd;
use scale::Plane;

/// Features per block at one scale.
const PER_SCALE: usize = 18;
/// Features per block.
const FEATURES: usize = 2 * PER_SCALE;
/// Neighbours (rows, columns) whose products are taken.
const NEIGHBOURS: [(usize, isize); 4] = [(0, 1), (1, 0), (1, 1), (1, -1)];

/// Why an image has no score.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NiqeError {
    /// Too few blocks for a covariance.
    #[error(
        "NIQE needs at least two blocks of {block_px} x {block_px} pixels, got an image of {width} x {height}"
    )]
    TooSmall {
        /// Edge of a block, pixels.
        block_px: usize,
        /// Image width, pixels.
        width: usize,
        /// Image height, pixels.
        height: usize,
    },
    /// The edge of a block must be even and hold enough pixels for a distribution.
    #[error("the edge of NIQE's blocks must be even and at least 16 pixels, got {0}")]
    BlockSize(usize),
    /// All blocks but one or none are flat.
    #[error("fewer than two blocks of the image have any contrast")]
    Flat,
}

/// The score of a grey image (values 0 to 255, row 0 first) with blocks of `block_px` × `block_px`; the pristine
/// images were measured with 96. Remainders at right and bottom are cut off.
pub fn niqe(
    pristine: &Pristine,
    width: usize,
    height: usize,
    grey: &[f64],
    block_px: usize,
) -> Result<f64, NiqeError> {
    if block_px < 16 || !block_px.is_multiple_of(2) {
        return Err(NiqeError::BlockSize(block_px));
    }
    let (columns, rows) = (width / block_px, height / block_px);
    if columns * rows < 2 || grey.len() != width * height {
        return Err(NiqeError::TooSmall {
            block_px,
            width,
            height,
        });
    }
    let full = Plane::cut(grey, width, columns * block_px, rows * block_px);
    let half = full.halved();
    let (fine, coarse) = (full.normalised(), half.normalised());
    let mut samples: Vec<[f64; FEATURES]> = Vec::with_capacity(columns * rows);
    for (column, row) in (0..columns).flat_map(|c| (0..rows).map(move |r| (c, r))) {
        let mut all = [0.0; FEATURES];
        for (plane, edge, part) in [(&fine, block_px, 0), (&coarse, block_px / 2, PER_SCALE)] {
            let block = plane.block(column * edge, row * edge, edge);
            all[part..part + PER_SCALE].copy_from_slice(&features(&block, edge));
        }
        if all.iter().all(|v| v.is_finite()) {
            samples.push(all);
        }
    }
    pristine.distance(&samples).ok_or(NiqeError::Flat)
}

/// The 18 parameters of a block at one scale.
fn features(block: &[f64], edge: usize) -> [f64; PER_SCALE] {
    let mut out = [0.0; PER_SCALE];
    let own = Aggd::fit(block);
    out[0] = own.shape;
    out[1] = 0.5 * (own.left + own.right);
    let mut products = vec![0.0; block.len()];
    for (k, &(down, across)) in NEIGHBOURS.iter().enumerate() {
        for y in 0..edge {
            let from_row = (y + edge - down) % edge * edge;
            for x in 0..edge {
                let from_column = (x as isize - across).rem_euclid(edge as isize) as usize;
                products[y * edge + x] = block[y * edge + x] * block[from_row + from_column];
            }
        }
        let fit = Aggd::fit(&products);
        out[2 + 4 * k..6 + 4 * k].copy_from_slice(&[fit.shape, fit.mean(), fit.left, fit.right]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(width: usize, height: usize) -> Vec<f64> {
        let mut state = 1_u32;
        (0..width * height)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 24)
            })
            .collect()
    }

    #[test]
    fn what_cannot_be_scored_is_refused() {
        let pristine = Pristine::shipped().expect("shipped");
        let score = |w: usize, h: usize, grey: &[f64], block| niqe(&pristine, w, h, grey, block);
        let flat = vec![7.0; 128 * 64];
        assert_eq!(score(128, 64, &flat, 64), Err(NiqeError::Flat));
        assert_eq!(score(128, 64, &flat, 15), Err(NiqeError::BlockSize(15)));
        let small = noise(100, 64);
        assert!(matches!(
            score(100, 64, &small, 64),
            Err(NiqeError::TooSmall { .. })
        ));
    }

    #[test]
    fn blur_is_farther_from_pristine_than_a_picture_of_all_scales() {
        // A sum of patterns of all sizes against the same without the finest.
        let (width, height) = (192, 96);
        let fine = noise(width, height);
        let value = |x: usize, y: usize, levels: std::ops::Range<u32>| -> f64 {
            levels
                .map(|level| {
                    let step = 1 << level;
                    fine[(y / step * width + x / step + 37 * level as usize) % fine.len()]
                })
                .sum::<f64>()
        };
        let picture = |levels: std::ops::Range<u32>| -> Vec<f64> {
            (0..width * height)
                .map(|i| value(i % width, i / width, levels.clone()) / 6.0)
                .collect()
        };
        let pristine = Pristine::shipped().expect("shipped");
        let score = |grey: &[f64]| niqe(&pristine, width, height, grey, 48).expect("score");
        let (all, coarse) = (score(&picture(0..6)), score(&picture(3..6)));
        assert!(coarse > 1.2 * all, "{all} {coarse}");
    }
}
