//! A picture in small blocks: their mean signals beside what the water adds and leaves there.

use super::LinearPicture;
use super::grid;
use super::light::Seen;

/// Blocks across a picture and down.
pub(super) const COLUMNS: usize = 120;
/// See [`COLUMNS`].
pub(super) const ROWS: usize = 72;

/// One block in one channel, linear signal.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cell {
    /// Of the picture.
    pub(super) signal: f64,
    /// Of the light that never met the target.
    pub(super) veil: f64,
    /// That a target of reflectance 1 would add.
    pub(super) gain: f64,
}

impl Cell {
    /// Reflectance of the target in the block.
    pub(super) fn reflectance(&self) -> f64 {
        (self.signal - self.veil) / self.gain.max(f64::MIN_POSITIVE)
    }
}

/// Blocks of a picture or of a part of it, row by row.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) cells: Vec<[Cell; 3]>,
}

impl Blocks {
    /// Of a picture of [`COLUMNS`] × [`ROWS`] blocks, or of as many as it has pixels.
    pub(super) fn new(picture: &LinearPicture, seen: &Seen, exposure: f64) -> Self {
        let (columns, rows) = (COLUMNS.min(picture.width), ROWS.min(picture.height));
        let mut cells = vec![[Cell::default(); 3]; columns * rows];
        let mut pixels = vec![0u32; columns * rows];
        for (i, signal) in picture.signal.iter().enumerate() {
            let (x, y) = (i % picture.width, i / picture.width);
            let block = y * rows / picture.height * columns + x * columns / picture.width;
            pixels[block] += 1;
            (0..3).for_each(|k| cells[block][k].signal += f64::from(signal[k]));
        }
        for (i, block) in cells.iter_mut().enumerate() {
            let u = (i % columns) as f64 + 0.5;
            let v = (i / columns) as f64 + 0.5;
            let (u, v) = (u / columns as f64, v / rows as f64);
            for (k, cell) in block.iter_mut().enumerate() {
                cell.signal /= f64::from(pixels[i].max(1));
                cell.veil = exposure * grid::at(&seen.veil[k], u, v).max(0.0);
                cell.gain = exposure * grid::at(&seen.gain[k], u, v).max(1e-12);
            }
        }
        Self {
            columns,
            rows,
            cells,
        }
    }

    /// As many blocks as fit, each `times` as wide and high, >= 1.
    pub(super) fn merged(&self, times: f64) -> Self {
        let edge = |i: usize, n: usize| ((i as f64 * times).round() as usize).min(n);
        let fit = |n: usize| (n as f64 / times + 1e-9) as usize;
        let (columns, rows) = (fit(self.columns), fit(self.rows));
        let mean = |i: usize| {
            let (column, row) = (i % columns, i / columns);
            let mut sum = [Cell::default(); 3];
            let mut n = 0.0;
            for y in edge(row, self.rows)..edge(row + 1, self.rows) {
                for x in edge(column, self.columns)..edge(column + 1, self.columns) {
                    n += 1.0;
                    for (sum, cell) in sum.iter_mut().zip(&self.cells[y * self.columns + x]) {
                        sum.signal += cell.signal;
                        sum.veil += cell.veil;
                        sum.gain += cell.gain;
                    }
                }
            }
            sum.map(|sum| Cell {
                signal: sum.signal / n,
                veil: sum.veil / n,
                gain: sum.gain / n,
            })
        };
        Self {
            columns,
            rows,
            cells: (0..columns * rows).map(mean).collect(),
        }
    }

    /// Mean of a channel's reflectance over the blocks.
    pub(super) fn reflectance(&self, k: usize) -> f64 {
        let sum: f64 = self.cells.iter().map(|block| block[k].reflectance()).sum();
        sum / self.cells.len() as f64
    }
}
