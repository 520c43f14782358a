//! Local weighted regression of a layer on what is known without noise, at several sizes of cells: each cell has a fit of every
//! region in it, from the pixels in it and in the cells around it, and a pixel has the mean of the fits of the four nearest cells.

use std::sync::atomic::{AtomicBool, Ordering};

use super::basis::Basis;
use super::cells::{FittedCells, Summed};
use super::guides::Guides;

/// Edges of the smallest and of the largest cells, pixels, of which there are all powers of two in between: each candidate's window is
/// three of them wide.
pub(super) const SMALLEST_CELL_PX: usize = 4;
const LARGEST_CELL_PX: usize = 128;
/// Fewest cells along the longer side of the picture, but for the smallest ones.
const FEWEST_CELLS: usize = 4;

/// What is fitted.
pub(super) struct Problem<'a> {
    pub(super) guides: &'a Guides,
    pub(super) blurred: &'a [[[f32; 3]; 4]],
    pub(super) basis: &'a Basis,
    /// The layer, half by half.
    pub(super) halves: [&'a [[f32; 3]]; 2],
    /// Weight of each pixel, half by half.
    pub(super) weights: [&'a [[f32; 3]]; 2],
    /// Whether nobody waits for it any more.
    pub(super) cancel: &'a AtomicBool,
}

/// Values of a pixel by each half's fit: all over the pixel, where its own samples looked, where the other's did.
pub(super) type Values = [[[f32; 3]; 2]; 3];
pub(super) const SHOWN: usize = 0;
pub(super) const OWN: usize = 1;
pub(super) const CROSSED: usize = 2;

/// A layer as the fits of all sizes of cells show it.
pub(super) struct Fitted {
    /// Number of sizes.
    pub(super) sizes: usize,
    /// Pixel by pixel, from small cells to large ones; none where there was no fit for all of a pixel.
    pub(super) values: Vec<Option<Values>>,
}

impl Problem<'_> {
    /// Fits at all sizes of cells, from small to large; none where it is cancelled.
    pub(super) fn fit(&self) -> Option<Fitted> {
        let longest = self.guides.width.max(self.guides.height);
        let largest = (longest / FEWEST_CELLS).min(LARGEST_CELL_PX);
        let mut summed = Summed::of(self, SMALLEST_CELL_PX)?;
        let mut sizes: Vec<FittedCells> = vec![summed.fits(self.basis)];
        let mut cell_px = 2 * SMALLEST_CELL_PX;
        while cell_px <= largest {
            if self.cancel.load(Ordering::Relaxed) {
                return None;
            }
            summed = summed.merged(self.basis);
            sizes.push(summed.fits(self.basis));
            cell_px *= 2;
        }
        Some(Fitted {
            sizes: sizes.len(),
            values: self.values(&sizes),
        })
    }
}
