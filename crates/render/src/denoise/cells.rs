//! Sums over cells of the picture, surface by surface, and the fits that follow from them: larger cells are made of smaller ones, and
//! a fit of those around it.

use std::sync::atomic::Ordering;

use rayon::prelude::*;

use super::basis::{Basis, MOST_TERMS, View};
use super::lanes::{Lanes, ZERO, lanes};
use super::regression::Problem;
use super::solve::{Moments, Recast};

/// Pixels that a fit needs, over its number of terms.
const PIXELS_PER_TERM: f64 = 12.0;
/// Weight of a cell beside another, in each direction.
const WEIGHT_BESIDE: f64 = 0.5;

/// Square cells of one size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Side of a cell, pixels.
    pub(super) cell_px: usize,
}

/// What is known of a region in a cell.
#[derive(Clone)]
struct Block {
    region: u32,
    pixels: f64,
    moments: Moments,
}

/// Cells with what is known of their regions, which are in order.
pub(super) struct Summed {
    grid: Grid,
    blocks: Vec<Vec<Block>>,
    /// Largest size of the layer's values, per channel.
    most: Vec<[f32; 3]>,
}

/// Coefficients of a region in a cell.
pub(super) struct Fit {
    pub(super) region: u32,
    pub(super) coefficients: [Lanes; MOST_TERMS],
}

/// Cells with fits of their regions, which are in order.
pub(super) struct FittedCells {
    pub(super) grid: Grid,
    pub(super) fits: Vec<Vec<Fit>>,
    /// Largest size of the layer's values, per channel, in each cell and those around it.
    pub(super) seen: Vec<[f32; 3]>,
}

impl Grid {
    fn of(width: usize, height: usize, cell_px: usize) -> Self {
        Self {
            columns: width.div_ceil(cell_px),
            rows: height.div_ceil(cell_px),
            cell_px,
        }
    }

    /// Cells of twice the size.
    fn larger(self) -> Self {
        Self {
            columns: self.columns.div_ceil(2),
            rows: self.rows.div_ceil(2),
            cell_px: 2 * self.cell_px,
        }
    }

    /// Place of a pixel's middle in cells from the middle of a cell, along a row or a column.
    pub(super) fn place(self, pixel: usize, cell: usize) -> f64 {
        (pixel as f64 + 0.5) / self.cell_px as f64 - (cell as f64 + 0.5)
    }

    /// What `of` says of every cell, a column and a row, row by row.
    fn map<T: Send>(self, of: impl Fn(usize, usize) -> T + Sync) -> Vec<T> {
        let of_row = |row: usize| (0..self.columns).map(|x| of(x, row)).collect::<Vec<T>>();
        let rows: Vec<Vec<T>> = (0..self.rows).into_par_iter().map(of_row).collect();
        rows.into_iter().flatten().collect()
    }
}

impl Block {
    fn none(region: u32, terms: usize) -> Self {
        Self {
            region,
            pixels: 0.0,
            moments: Moments::none(terms),
        }
    }
}

/// Another cell's blocks, how their moments come to this one, and with which weight.
struct Part<'a> {
    blocks: &'a [Block],
    recast: &'a Recast,
    weight: f64,
}

impl Summed {
    /// Sums over the pixels that show one region alone; none where it is cancelled.
    pub(super) fn of(problem: &Problem<'_>, cell_px: usize) -> Option<Self> {
        let guides = problem.guides;
        let grid = Grid::of(guides.width, guides.height, cell_px);
        let of_cell = |column: usize, row: usize| {
            if problem.cancel.load(Ordering::Relaxed) {
                return (Vec::new(), [0.0; 3]);
            }
            (
                blocks(problem, grid, (column, row)),
                most(problem, grid, (column, row)),
            )
        };
        let (blocks, most) = grid.map(of_cell).into_iter().unzip();
        let is_wanted = !problem.cancel.load(Ordering::Relaxed);
        is_wanted.then_some(Self { grid, blocks, most })
    }

    /// The same of cells of twice the size.
    pub(super) fn merged(&self, basis: &Basis) -> Self {
        let quarters = [(0, 0), (1, 0), (0, 1), (1, 1)];
        // From the middle of a cell to those of its quarters, cells.
        let off = |quarter: usize| 0.5 * quarter as f64 - 0.25;
        let recasts = quarters.map(|(x, y)| Recast::of(basis, 0.5, (off(x), off(y)), 1.0));
        let grid = self.grid.larger();
        let quarters_of = |column: usize, row: usize| {
            let places = quarters.map(|(x, y)| (2 * column + x, 2 * row + y));
            let with_recasts = places.into_iter().zip(&recasts);
            with_recasts.filter_map(|((x, y), recast)| Some((self.index(x, y)?, recast)))
        };
        let blocks = grid.map(|column, row| {
            let parts = quarters_of(column, row).map(|(index, recast)| Part {
                blocks: &self.blocks[index],
                recast,
                weight: 1.0,
            });
            joined(parts, basis.len())
        });
        let most = grid.map(|column, row| {
            let parts = quarters_of(column, row).map(|(index, _)| &self.most[index]);
            parts.fold([0.0; 3], larger)
        });
        Self { grid, blocks, most }
    }

    /// The fits, each from a cell and those around it.
    pub(super) fn fits(&self, basis: &Basis) -> FittedCells {
        let beside = |along: &dyn Fn(f64) -> (f64, f64)| {
            [-1.0_f64, 0.0, 1.0].map(|step| {
                let weight = WEIGHT_BESIDE.powf(step.abs());
                (Recast::of(basis, 1.0, along(step), weight), weight)
            })
        };
        let terms = basis.len();
        let across = beside(&|step| (step, 0.0));
        let aside = self.grid.map(|column, row| {
            joined(
                three(&across, |step| {
                    let index = self.index((column + step).checked_sub(1)?, row)?;
                    Some(&self.blocks[index][..])
                }),
                terms,
            )
        });
        let down = beside(&|step| (0.0, step));
        let fits = self.grid.map(|column, row| {
            let around = three(&down, |step| {
                let index = self.index(column, (row + step).checked_sub(1)?)?;
                Some(&aside[index][..])
            });
            let blocks = joined(around, terms);
            blocks
                .iter()
                .filter_map(|block| fit(block, terms))
                .collect()
        });
        FittedCells {
            grid: self.grid,
            fits,
            seen: self.largest_around(),
        }
    }

    fn largest_around(&self) -> Vec<[f32; 3]> {
        let Grid { columns, rows, .. } = self.grid;
        self.grid.map(|column, row| {
            let mut seen = [0.0; 3];
            for y in row.saturating_sub(1)..(row + 2).min(rows) {
                for x in column.saturating_sub(1)..(column + 2).min(columns) {
                    seen = larger(seen, &self.most[y * columns + x]);
                }
            }
            seen
        })
    }

    /// Index of a cell; none beyond the picture.
    fn index(&self, column: usize, row: usize) -> Option<usize> {
        let is_inside = column < self.grid.columns && row < self.grid.rows;
        is_inside.then(|| row * self.grid.columns + column)
    }
}

/// The parts of a sum over a cell and the two beside it, whose blocks `of` says.
fn three<'a>(
    beside: &'a [(Recast, f64); 3],
    of: impl Fn(usize) -> Option<&'a [Block]>,
) -> impl Iterator<Item = Part<'a>> {
    let parts = beside.iter().enumerate();
    parts.filter_map(move |(step, (recast, weight))| {
        Some(Part {
            blocks: of(step)?,
            recast,
            weight: *weight,
        })
    })
}

/// Sums over cells, region by region.
fn joined<'a>(parts: impl Iterator<Item = Part<'a>>, terms: usize) -> Vec<Block> {
    let mut all: Vec<Block> = Vec::new();
    for part in parts {
        for block in part.blocks {
            let own = of_region(&mut all, block.region, terms);
            own.pixels += part.weight * block.pixels;
            own.moments.add_recast(&block.moments, part.recast);
        }
    }
    all
}

/// The block of a region in a list in order, to which it is added where it is not there yet.
fn of_region(blocks: &mut Vec<Block>, region: u32, terms: usize) -> &mut Block {
    let index = match blocks.binary_search_by_key(&region, |block| block.region) {
        Ok(index) => index,
        Err(index) => {
            blocks.insert(index, Block::none(region, terms));
            index
        }
    };
    &mut blocks[index]
}

/// The fit of a region; none of too few pixels. A surface of few has its first terms alone.
fn fit(block: &Block, terms: usize) -> Option<Fit> {
    let terms = ((block.pixels / PIXELS_PER_TERM) as usize).min(terms);
    (terms > 0).then(|| Fit {
        region: block.region,
        coefficients: block.moments.solve(terms),
    })
}

/// Pixels of a cell, with their columns and rows.
fn pixels(
    problem: &Problem<'_>,
    grid: Grid,
    (column, row): (usize, usize),
) -> impl Iterator<Item = (usize, usize, usize)> {
    let (width, height) = (problem.guides.width, problem.guides.height);
    let (left, top) = (column * grid.cell_px, row * grid.cell_px);
    let columns = left..(left + grid.cell_px).min(width);
    let rows = top..(top + grid.cell_px).min(height);
    rows.flat_map(move |y| columns.clone().map(move |x| (y * width + x, x, y)))
}

/// What the pixels of a cell say that show one region.
fn blocks(problem: &Problem<'_>, grid: Grid, cell: (usize, usize)) -> Vec<Block> {
    let basis = problem.basis;
    let terms = basis.len();
    let mut blocks: Vec<Block> = Vec::new();
    let mut row = [ZERO; MOST_TERMS + 1];
    for (pixel, x, y) in pixels(problem, grid, cell) {
        let Some(fragment) = problem.guides.pure(pixel) else {
            continue;
        };
        let carried = basis.carriers(fragment, &problem.blurred[pixel], View::Sampled);
        let (u, v) = (grid.place(x, cell.0), grid.place(y, cell.1));
        basis.terms_at(&carried, u, v, &mut row);
        row[terms] = lanes(|k, half| f64::from(problem.halves[half][pixel][k]));
        let weight = lanes(|k, _| f64::from(problem.weights[pixel][k]));
        let block = of_region(&mut blocks, fragment.region, terms);
        block.pixels += 1.0;
        block.moments.add(&row, &weight);
    }
    blocks
}

/// Largest size of the layer's values in a cell.
fn most(problem: &Problem<'_>, grid: Grid, cell: (usize, usize)) -> [f32; 3] {
    let values = pixels(problem, grid, cell)
        .flat_map(|(pixel, ..)| problem.halves.map(|half| half[pixel].map(f32::abs)));
    values.fold([0.0; 3], |most, value| larger(most, &value))
}

fn larger(a: [f32; 3], b: &[f32; 3]) -> [f32; 3] {
    std::array::from_fn(|k| a[k].max(b[k]))
}
