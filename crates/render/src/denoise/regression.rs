//! Local weighted regression of a layer on what is known without noise, at one size of cells: each cell has a fit of every
//! region in it, from the pixels in it and in the cells around it, and a pixel has the mean of the fits of the four nearest cells.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::basis::{Basis, MOST_TERMS, View};
use super::guides::{Fragment, Guides, NO_REGION};
use super::selection::Halves;
use super::solve::Moments;

/// Cells whose moments are summed up at once, rows of them.
const ROWS_AT_ONCE: usize = 8;
/// Pixels that a fit needs, over its number of terms.
const PIXELS_PER_TERM: f64 = 12.0;
/// What a fit may say of a pixel, over the largest value of the layer in the cells that it was made from: beyond, it speaks of what it
/// has not seen.
const MOST_OF_SEEN: f64 = 1.5;
/// How far below no light it may come out, over the same.
const BELOW_NONE: f64 = 0.02;

/// Largest difference of the transmittances before two surfaces in a pixel of which one may follow the other's fit: the veils before them
/// are then alike.
const ALIKE: f32 = 0.05;

/// What is fitted.
pub(super) struct Problem<'a> {
    pub(super) guides: &'a Guides,
    pub(super) blurred: &'a [[[f32; 3]; 4]],
    pub(super) basis: &'a Basis,
    /// The layer, half by half.
    pub(super) halves: [&'a [[f32; 3]]; 2],
    /// Weight of each pixel.
    pub(super) weights: &'a [[f32; 3]],
    /// Whether nobody waits for it any more.
    pub(super) cancel: &'a AtomicBool,
}

/// A layer as the fits of one size of cells show it.
pub(super) struct Fitted {
    /// By each half's fit, all over the pixel.
    pub(super) shown: Halves,
    /// By each half's fit where its own samples looked.
    pub(super) own: Halves,
    /// By each half's fit where the other's samples looked.
    pub(super) crossed: Halves,
    /// Whether there was a fit for all of a pixel.
    pub(super) known: Vec<bool>,
}

/// Moments of a region in a cell, per channel.
struct Block {
    region: u32,
    pixels: f64,
    moments: [[Moments; 2]; 3],
}

/// Coefficients of a region in a cell, per channel and half.
struct Fit {
    region: u32,
    coefficients: [[[f64; MOST_TERMS]; 2]; 3],
}

/// All cells of a size.
struct FittedCells {
    fits: Cells<Fit>,
    /// Largest size of the layer's values, per channel, in each cell and those around it.
    seen: Vec<[f32; 3]>,
    columns: usize,
    rows: usize,
    cell_px: usize,
}

type Cells<T> = Vec<Vec<T>>;
/// Of the carriers at a place, per channel and half.
type Coefficients = [[[f64; MOST_TERMS]; 2]; 3];
/// Values of a pixel by each half's fit: all over the pixel, where its own samples looked, where the other's did.
type Values = [[[f32; 3]; 2]; 3];
const SHOWN: usize = 0;
const OWN: usize = 1;
const CROSSED: usize = 2;
/// Weight of a cell beside another, and of which terms there the terms here are made, and how much of each.
type Shifted = (f64, Vec<Vec<(usize, f64)>>);

impl Problem<'_> {
    /// Fits at cells of `cell_px` pixels a side; none where it is cancelled.
    pub(super) fn fit(&self, cell_px: usize) -> Option<Fitted> {
        let (width, height) = (self.guides.width, self.guides.height);
        let (columns, rows) = (width.div_ceil(cell_px), height.div_ceil(cell_px));
        let shifts = self.shifts();
        let bands: Vec<usize> = (0..rows).step_by(ROWS_AT_ONCE).collect();
        let fits: Option<Vec<Cells<Fit>>> = bands
            .into_par_iter()
            .map(|first| {
                if self.cancel.load(Ordering::Relaxed) {
                    return None;
                }
                let last = (first + ROWS_AT_ONCE).min(rows);
                let (from, to) = (first.saturating_sub(1), (last + 1).min(rows));
                let blocks: Vec<Vec<Block>> = (from * columns..to * columns)
                    .map(|cell| self.blocks(cell % columns, cell / columns, cell_px))
                    .collect();
                let at = |x: usize, y: usize| &blocks[(y - from) * columns + x];
                let range = |y: usize| (y.saturating_sub(1), (y + 2).min(to));
                let fits = (first * columns..last * columns)
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
                    .collect();
                Some(fits)
            })
            .collect();
        let fits = fits?.into_iter().flatten().collect();
        let cells = FittedCells {
            fits,
            seen: self.largest_around(columns, rows, cell_px),
            columns,
            rows,
            cell_px,
        };
        Some(self.evaluate(&cells))
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
                            moments: [[Moments::ZERO; 2]; 3],
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
            let weight = f64::from(self.weights[pixel][k]);
            for half in 0..2 {
                let view = View::Sampled(half);
                let mut terms = self.basis.carriers(fragment, &self.blurred[pixel], k, view);
                for (term, monomial) in terms.iter_mut().zip(&monomials) {
                    *term *= monomial;
                }
                let value = f64::from(self.halves[half][pixel][k]);
                block.moments[k][half].add(&terms[..count], weight, value);
            }
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
            let (mut pixels, mut moments) = (0.0, [[Moments::ZERO; 2]; 3]);
            for ((weight, parts), blocks) in around {
                for block in blocks.iter().filter(|block| block.region == region) {
                    pixels += weight * block.pixels;
                    let all = moments.iter_mut().zip(&block.moments);
                    for (sum, own) in all.flat_map(|(sum, own)| sum.iter_mut().zip(own)) {
                        sum.add_shifted(own, *weight, parts);
                    }
                }
            }
            // A surface of few pixels has its first terms alone.
            let terms = ((pixels / PIXELS_PER_TERM) as usize).min(count);
            (terms > 0).then(|| Fit {
                region,
                coefficients: moments.map(|channel| channel.map(|half| half.solve(terms))),
            })
        };
        regions.into_iter().filter_map(of).collect()
    }

    /// Largest size of the layer's values in each cell and those around it.
    fn largest_around(&self, columns: usize, rows: usize, cell_px: usize) -> Vec<[f32; 3]> {
        let mut own = vec![[0.0_f32; 3]; columns * rows];
        let larger = |a: &mut [f32; 3], b: &[f32; 3]| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = a.max(b.abs()));
        };
        for half in self.halves {
            for (pixel, value) in half.iter().enumerate() {
                let (x, y) = (pixel % self.guides.width, pixel / self.guides.width);
                larger(&mut own[y / cell_px * columns + x / cell_px], value);
            }
        }
        let around = |cell: usize| {
            let (column, row) = (cell % columns, cell / columns);
            let mut most = [0.0; 3];
            for y in row.saturating_sub(1)..(row + 2).min(rows) {
                for x in column.saturating_sub(1)..(column + 2).min(columns) {
                    larger(&mut most, &own[y * columns + x]);
                }
            }
            most
        };
        (0..columns * rows).map(around).collect()
    }

    fn evaluate(&self, cells: &FittedCells) -> Fitted {
        let (columns, rows, cell_px) = (cells.columns, cells.rows, cells.cell_px);
        let width = self.guides.width;
        let of_row = |y: usize| {
            let near_rows = nearest(y, cell_px, rows);
            (0..width)
                .map(|x| {
                    let near_columns = nearest(x, cell_px, columns);
                    let mut near = [(0, 0, 0.0); 4];
                    for (i, cell) in near.iter_mut().enumerate() {
                        let (column, a) = near_columns[i % 2];
                        let (row, b) = near_rows[i / 2];
                        *cell = (column, row, a * b);
                    }
                    self.value(cells, (x, y), &near)
                })
                .collect::<Vec<_>>()
        };
        let rows: Vec<Vec<Option<Values>>> = (0..self.guides.height)
            .into_par_iter()
            .map(of_row)
            .collect();
        let pixels = || rows.iter().flatten();
        let plane = |way: usize, half: usize| {
            let value = |v: &Option<Values>| v.map_or([0.0; 3], |v| v[way][half]);
            pixels().map(value).collect::<Vec<_>>()
        };
        let halves = |way: usize| [plane(way, 0), plane(way, 1)];
        Fitted {
            shown: halves(SHOWN),
            own: halves(OWN),
            crossed: halves(CROSSED),
            known: pixels().map(Option::is_some).collect(),
        }
    }

    /// The values of a pixel: sums over its fragments of what the fits of the cells near it say; none where that is far from all that
    /// these have seen.
    fn value(
        &self,
        cells: &FittedCells,
        (x, y): (usize, usize),
        near_cells: &[(usize, usize, f64); 4],
    ) -> Option<Values> {
        let columns = cells.columns;
        let pixel = y * self.guides.width + x;
        let varied = self.guides.is_varied(pixel);
        let mut sum = [[[0.0_f64; 3]; 2]; 3];
        let fragments = self.guides.pixel(pixel);
        let own: Vec<Option<Coefficients>> = (fragments.iter())
            .map(|fragment| self.coefficients(cells, (x, y), near_cells, fragment.region))
            .collect();
        for (fragment, coefficients) in fragments.iter().zip(&own) {
            let (other, coefficients) = match coefficients {
                Some(coefficients) => (None, coefficients),
                None => {
                    let (other, coefficients) = stand_in(fragment, fragments, &own)?;
                    (Some(other), coefficients)
                }
            };
            let region = other.unwrap_or(fragment).region;
            let blurred = &self.blurred[self.nearest_pure((x, y), region)];
            let carriers = |k, view| match other {
                None => self.basis.carriers(fragment, blurred, k, view),
                Some(other) => (self.basis).carriers_beside(fragment, other, blurred, k, view),
            };
            self.add_fragment(&mut sum, varied, carriers, coefficients);
        }
        if !varied {
            (sum[OWN], sum[CROSSED]) = (sum[SHOWN], sum[SHOWN]);
        }
        let seen: [f64; 3] = std::array::from_fn(|k| {
            let of =
                |&(column, row, _): &(usize, usize, f64)| cells.seen[row * columns + column][k];
            f64::from(near_cells.iter().map(of).fold(0.0, f32::max))
        });
        let range = |k: usize| -BELOW_NONE * seen[k]..=MOST_OF_SEEN * seen[k];
        let far = |half: &[f64; 3]| (0..3).any(|k| !range(k).contains(&half[k]));
        if sum.iter().flatten().any(far) {
            return None;
        }
        Some(sum.map(|way| way.map(|half| half.map(|v| v as f32))))
    }

    /// The mean of the fits of a region in the cells near a pixel; none where they have none.
    fn coefficients(
        &self,
        cells: &FittedCells,
        (x, y): (usize, usize),
        near_cells: &[(usize, usize, f64); 4],
        region: u32,
    ) -> Option<Coefficients> {
        if region == NO_REGION {
            return None;
        }
        mean_coefficients(near_cells.iter().filter_map(|&(column, row, weight)| {
            let mut fits = cells.fits[row * cells.columns + column].iter();
            let fit = fits.find(|fit| fit.region == region)?;
            let (u, v) = place(x, y, column, row, cells.cell_px);
            (weight > 0.0).then(|| (fit, weight, self.basis.monomials(u, v)))
        }))
    }

    /// The pixel beside (x, y) that shows nothing but `region`, itself where none does. Blurred light jumps at the edge of what is
    /// bright, where fits were made beside it: they say nothing of values a hundred times those that they have met.
    fn nearest_pure(&self, (x, y): (usize, usize), region: u32) -> usize {
        let (width, height) = (self.guides.width, self.guides.height);
        let own = y * width + x;
        let shows = |pixel: usize| self.guides.pure(pixel).is_some_and(|f| f.region == region);
        if shows(own) {
            return own;
        }
        let columns = x.saturating_sub(1)..(x + 2).min(width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        let around = rows.flat_map(|row| columns.clone().map(move |column| (column, row)));
        let distance = |&(column, row): &(usize, usize)| column.abs_diff(x) + row.abs_diff(y);
        let near = around.filter(|&(column, row)| shows(row * width + column));
        near.min_by_key(distance)
            .map_or(own, |(column, row)| row * width + column)
    }

    /// Adds what `coefficients` say of a fragment with these carriers in every way; where samples have seen nothing else, which
    /// `varied` says, only all over the pixel.
    fn add_fragment(
        &self,
        sum: &mut [[[f64; 3]; 2]; 3],
        varied: bool,
        carriers: impl Fn(usize, View) -> [f64; MOST_TERMS],
        coefficients: &Coefficients,
    ) {
        let count = self.basis.len();
        for k in 0..3 {
            let say = |half: usize, carriers: &[f64; MOST_TERMS]| {
                let own = coefficients[k][half].iter().zip(carriers);
                own.take(count).map(|(c, carrier)| c * carrier).sum::<f64>()
            };
            for half in 0..2 {
                sum[SHOWN][half][k] += say(half, &carriers(k, View::Shown(half)));
                if varied {
                    let sampled = carriers(k, View::Sampled(half));
                    sum[OWN][half][k] += say(half, &sampled);
                    sum[CROSSED][1 - half][k] += say(1 - half, &sampled);
                }
            }
        }
    }
}

/// The fragment whose fit one without a fit follows, such as a speck far away: the largest one in its pixel that has a fit and
/// about the same water before it.
fn stand_in<'c>(
    fragment: &Fragment,
    all: &'c [Fragment],
    coefficients: &'c [Option<Coefficients>],
) -> Option<(&'c Fragment, &'c Coefficients)> {
    let share = |fragment: &Fragment| fragment.shown[0].share + fragment.shown[1].share;
    let alike = |other: &Fragment| {
        let pairs = fragment.shown.iter().zip(&other.shown);
        pairs
            .flat_map(|(a, b)| a.transmittance.iter().zip(&b.transmittance))
            .all(|(a, b)| (a - b).abs() <= ALIKE)
    };
    let known = all
        .iter()
        .zip(coefficients)
        .filter(|(other, _)| alike(other));
    known
        .filter_map(|(other, own)| Some((other, own.as_ref()?)))
        .max_by(|(a, _), (b, _)| share(a).total_cmp(&share(b)))
}

/// The weighted mean of fits at one place, as coefficients of the carriers; none of no fits.
fn mean_coefficients<'f>(
    fits: impl Iterator<Item = (&'f Fit, f64, [f64; MOST_TERMS])>,
) -> Option<Coefficients> {
    let (mut mean, mut weights) = ([[[0.0; MOST_TERMS]; 2]; 3], 0.0);
    for (fit, weight, monomials) in fits {
        for (mean, own) in mean.iter_mut().zip(&fit.coefficients) {
            for (mean, own) in mean.iter_mut().zip(own) {
                for ((mean, c), m) in mean.iter_mut().zip(own).zip(&monomials) {
                    *mean += weight * c * m;
                }
            }
        }
        weights += weight;
    }
    let mean = mean.map(|channel| channel.map(|half| half.map(|c| c / weights)));
    (weights > 0.0).then_some(mean)
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
