//! Local weighted regression of a layer on what is known without noise, at one size of cells: each cell has a fit of every
//! region in it, from the pixels in it and in the cells around it, and a pixel has the mean of the fits of the four nearest cells.

use rayon::prelude::*;

use super::basis::{Basis, MOST_TERMS};
use super::guides::{Fragment, Guides, NO_REGION};
use super::solve::Moments;

/// Cells whose moments are summed up at once, rows of them.
const ROWS_AT_ONCE: usize = 8;
/// Pixels that a fit needs, over its number of terms.
const PIXELS_PER_TERM: f64 = 2.0;

/// What is fitted.
pub(super) struct Problem<'a> {
    pub(super) guides: &'a Guides,
    pub(super) blurred: &'a [[[f32; 3]; 4]],
    pub(super) basis: &'a Basis,
    /// The layer, half by half.
    pub(super) halves: [&'a [[f32; 3]]; 2],
    /// Weight of each pixel.
    pub(super) weights: &'a [[f32; 3]],
}

/// The fits of a layer at one size of cells, half by half.
pub(super) struct Fitted {
    pub(super) halves: [Vec<[f32; 3]>; 2],
    /// Whether there was a fit for all of a pixel.
    pub(super) known: Vec<bool>,
}

/// Moments of a region in a cell, per channel.
struct Block {
    region: u32,
    pixels: f64,
    moments: [Moments; 3],
}

/// Coefficients of a region in a cell, per channel and half.
struct Fit {
    region: u32,
    coefficients: [[[f32; MOST_TERMS]; 2]; 3],
}

type Cells<T> = Vec<Vec<T>>;
/// Weight of a cell beside another, and of which terms there the terms here are made, and how much of each.
type Shifted = (f64, Vec<Vec<(usize, f64)>>);

impl Problem<'_> {
    /// Fits at cells of `cell_px` pixels a side.
    pub(super) fn fit(&self, cell_px: usize) -> Fitted {
        let (width, height) = (self.guides.width, self.guides.height);
        let (columns, rows) = (width.div_ceil(cell_px), height.div_ceil(cell_px));
        let shifts = self.shifts();
        let bands: Vec<usize> = (0..rows).step_by(ROWS_AT_ONCE).collect();
        let fits: Vec<Cells<Fit>> = bands
            .into_par_iter()
            .map(|first| {
                let last = (first + ROWS_AT_ONCE).min(rows);
                let (from, to) = (first.saturating_sub(1), (last + 1).min(rows));
                let blocks: Vec<Vec<Block>> = (from * columns..to * columns)
                    .map(|cell| self.blocks(cell % columns, cell / columns, cell_px))
                    .collect();
                let at = |x: usize, y: usize| &blocks[(y - from) * columns + x];
                let range = |y: usize| (y.saturating_sub(1), (y + 2).min(to));
                (first * columns..last * columns)
                    .map(|cell| {
                        let (x, y) = (cell % columns, cell / columns);
                        let mut around = Vec::new();
                        let (top, bottom) = range(y);
                        for row in top..bottom {
                            for column in x.saturating_sub(1)..(x + 2).min(columns) {
                                let shift = (row + 1 - y) * 3 + column + 1 - x;
                                around.push((&shifts[shift], at(column, row)));
                            }
                        }
                        self.fits(&around)
                    })
                    .collect()
            })
            .collect();
        let fits: Cells<Fit> = fits.into_iter().flatten().collect();
        self.evaluate(&fits, columns, rows, cell_px)
    }

    /// For each of the nine cells around one, row by row, its weight and how its terms are made.
    fn shifts(&self) -> Vec<Shifted> {
        let steps = [-1.0_f64, 0.0, 1.0];
        let of = |y: f64| {
            steps.map(|x| {
                let weight = 0.5_f64.powf(x.abs() + y.abs());
                (weight, self.basis.shifted(x, y))
            })
        };
        steps.into_iter().flat_map(of).collect()
    }

    /// Moments of a cell's pixels that show one region, region by region.
    fn blocks(&self, column: usize, row: usize, cell_px: usize) -> Vec<Block> {
        let guides = self.guides;
        let (left, top) = (column * cell_px, row * cell_px);
        let mut blocks: Vec<Block> = Vec::new();
        for y in top..(top + cell_px).min(guides.height) {
            for x in left..(left + cell_px).min(guides.width) {
                let pixel = y * guides.width + x;
                let Some(fragment) = guides.pure(pixel) else {
                    continue;
                };
                let index = match blocks.iter().position(|b| b.region == fragment.region) {
                    Some(index) => index,
                    None => {
                        blocks.push(Block {
                            region: fragment.region,
                            pixels: 0.0,
                            moments: [Moments::ZERO; 3],
                        });
                        blocks.len() - 1
                    }
                };
                let (u, v) = place(x, y, column, row, cell_px);
                self.add(&mut blocks[index], fragment, pixel, (u, v));
            }
        }
        blocks
    }

    fn add(&self, block: &mut Block, fragment: &Fragment, pixel: usize, (u, v): (f64, f64)) {
        let count = self.basis.len();
        let monomials = self.basis.monomials(u, v);
        block.pixels += 1.0;
        for k in 0..3 {
            let mut terms = self.basis.carriers(fragment, &self.blurred[pixel], k);
            for (term, monomial) in terms.iter_mut().zip(&monomials) {
                *term *= monomial;
            }
            let values = [0, 1].map(|half| f64::from(self.halves[half][pixel][k]));
            let weight = f64::from(self.weights[pixel][k]);
            block.moments[k].add(&terms[..count], weight, values);
        }
    }

    /// The fits of all regions in the cells `around` one.
    fn fits(&self, around: &[(&Shifted, &Vec<Block>)]) -> Vec<Fit> {
        let count = self.basis.len();
        let mut regions: Vec<u32> = around
            .iter()
            .flat_map(|(_, blocks)| blocks.iter().map(|block| block.region))
            .collect();
        regions.sort_unstable();
        regions.dedup();
        let of = |region: u32| {
            let (mut pixels, mut moments) = (0.0, [Moments::ZERO; 3]);
            for ((weight, parts), blocks) in around {
                for block in blocks.iter().filter(|block| block.region == region) {
                    pixels += weight * block.pixels;
                    for k in 0..3 {
                        moments[k].add_shifted(&block.moments[k], *weight, parts);
                    }
                }
            }
            (pixels >= PIXELS_PER_TERM * count as f64).then(|| Fit {
                region,
                coefficients: moments
                    .map(|moments| moments.solve(count).map(|half| half.map(|c| c as f32))),
            })
        };
        regions.into_iter().filter_map(of).collect()
    }

    fn evaluate(&self, fits: &Cells<Fit>, columns: usize, rows: usize, cell_px: usize) -> Fitted {
        let width = self.guides.width;
        let of_row = |y: usize| {
            let near_rows = nearest(y, cell_px, rows);
            (0..width)
                .map(|x| {
                    let near_columns = nearest(x, cell_px, columns);
                    let mut cells = [(0, 0, 0.0); 4];
                    for (i, cell) in cells.iter_mut().enumerate() {
                        let (column, a) = near_columns[i % 2];
                        let (row, b) = near_rows[i / 2];
                        *cell = (column, row, a * b);
                    }
                    self.value(fits, columns, (x, y), &cells, cell_px)
                })
                .collect::<Vec<_>>()
        };
        let rows: Vec<Vec<Option<[[f32; 3]; 2]>>> = (0..self.guides.height)
            .into_par_iter()
            .map(of_row)
            .collect();
        let pixels = || rows.iter().flatten();
        let half = |half: usize| pixels().map(|v| v.map_or([0.0; 3], |v| v[half])).collect();
        Fitted {
            halves: [half(0), half(1)],
            known: pixels().map(Option::is_some).collect(),
        }
    }

    /// The value of a pixel, half by half: the sum over its fragments of what the fits of `cells` say.
    fn value(
        &self,
        fits: &Cells<Fit>,
        columns: usize,
        (x, y): (usize, usize),
        cells: &[(usize, usize, f64); 4],
        cell_px: usize,
    ) -> Option<[[f32; 3]; 2]> {
        let pixel = y * self.guides.width + x;
        let count = self.basis.len();
        let mut sum = [[0.0_f64; 3]; 2];
        for fragment in self.guides.pixel(pixel) {
            if fragment.region == NO_REGION {
                return None;
            }
            let carriers =
                [0, 1, 2].map(|k| self.basis.carriers(fragment, &self.blurred[pixel], k));
            let (mut own, mut weights) = ([[0.0_f64; 3]; 2], 0.0);
            for &(column, row, weight) in cells {
                let found = fits[row * columns + column]
                    .iter()
                    .find(|fit| fit.region == fragment.region);
                let Some(fit) = found.filter(|_| weight > 0.0) else {
                    continue;
                };
                let (u, v) = place(x, y, column, row, cell_px);
                let monomials = self.basis.monomials(u, v);
                for k in 0..3 {
                    for half in 0..2 {
                        let coefficients = &fit.coefficients[k][half];
                        let mut value = 0.0;
                        for i in 0..count {
                            value += f64::from(coefficients[i]) * carriers[k][i] * monomials[i];
                        }
                        own[half][k] += weight * value;
                    }
                }
                weights += weight;
            }
            if weights <= 0.0 {
                return None;
            }
            let share = f64::from(fragment.share) / weights;
            for half in 0..2 {
                for k in 0..3 {
                    sum[half][k] += share * own[half][k];
                }
            }
        }
        Some(sum.map(|half| half.map(|v| v as f32)))
    }
}

/// Place of a pixel's middle in cells from the middle of a cell.
fn place(x: usize, y: usize, column: usize, row: usize, cell_px: usize) -> (f64, f64) {
    let size = cell_px as f64;
    let along = |pixel: usize, cell: usize| (pixel as f64 + 0.5) / size - (cell as f64 + 0.5);
    (along(x, column), along(y, row))
}

/// The two nearest of `count` cells and their weights.
fn nearest(pixel: usize, cell_px: usize, count: usize) -> [(usize, f64); 2] {
    let at = ((pixel as f64 + 0.5) / cell_px as f64 - 0.5).clamp(0.0, (count - 1) as f64);
    let first = (at as usize).min(count - 1);
    let second = (first + 1).min(count - 1);
    let part = at - first as f64;
    [(first, 1.0 - part), (second, part)]
}
