//! Sums over cells of the picture, surface by surface, and the fits that follow from them: larger cells are made of smaller ones, and
//! a fit of those around it.

use std::ops::Range;
use std::sync::atomic::Ordering;

use rayon::prelude::*;

use super::basis::{Basis, MOST_TERMS, View};
use super::lanes::{Lanes, ZERO, lanes};
use super::regions::entry;
use super::regression::Problem;
use super::solve::{Recast, add, add_recast, size, solve};

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
struct Block {
    region: u32,
    pixels: f64,
    /// Where its moments begin among those of its row.
    start: usize,
}

/// A row of cells, each with what is known of its regions, which are in order.
#[derive(Default)]
struct Row {
    cells: Vec<Vec<Block>>,
    moments: Vec<Lanes>,
}

/// Cells with what is known of their regions.
pub(super) struct Summed {
    grid: Grid,
    rows: Vec<Row>,
    /// Largest size of the layer's values, per channel, row by row.
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

    /// What `of` says of every row.
    fn rows<T: Send>(self, of: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..self.rows).into_par_iter().map(of).collect()
    }

    /// What `of` says of every cell, a column and a row, row by row.
    fn cells<T>(self, of: impl Fn(usize, usize) -> T) -> Vec<T> {
        let rows = 0..self.rows;
        rows.flat_map(|row| (0..self.columns).map(move |column| (column, row)))
            .map(|(column, row)| of(column, row))
            .collect()
    }
}

impl Row {
    /// With room for one region in each of as many cells.
    fn of(columns: usize, terms: usize) -> Self {
        Self {
            cells: Vec::with_capacity(columns),
            moments: Vec::with_capacity(columns * size(terms)),
        }
    }
}

/// A cell of another row, how its moments come to those of a cell here, and with which weight.
struct Part<'a> {
    row: &'a Row,
    column: usize,
    recast: &'a Recast,
    weight: f64,
}

impl Summed {
    /// Sums over the pixels that show one region alone; none where it is cancelled.
    pub(super) fn of(problem: &Problem<'_>, cell_px: usize) -> Option<Self> {
        let guides = problem.guides;
        let grid = Grid::of(guides.width, guides.height, cell_px);
        let rows = grid.rows(|y| {
            let mut row = Row::of(grid.columns, problem.basis.len());
            if !problem.cancel.load(Ordering::Relaxed) {
                for column in 0..grid.columns {
                    let blocks = blocks(problem, grid, (column, y), &mut row.moments);
                    row.cells.push(blocks);
                }
            }
            row
        });
        let most = grid.cells(|column, row| most(problem, grid, (column, row)));
        let is_wanted = !problem.cancel.load(Ordering::Relaxed);
        is_wanted.then_some(Self { grid, rows, most })
    }

    /// The same of cells of twice the size.
    pub(super) fn merged(&self, basis: &Basis) -> Self {
        let quarters = [(0, 0), (1, 0), (0, 1), (1, 1)];
        // From the middle of a cell to those of its quarters, cells.
        let off = |quarter: usize| 0.5 * quarter as f64 - 0.25;
        let recasts = quarters.map(|(x, y)| Recast::of(basis, 0.5, (off(x), off(y)), 1.0));
        let (grid, terms) = (self.grid.larger(), basis.len());
        let rows = grid.rows(|y| {
            let mut row = Row::of(grid.columns, terms);
            for column in 0..grid.columns {
                let parts = quarters.iter().zip(&recasts).filter_map(|(step, recast)| {
                    let column = 2 * column + step.0;
                    (column < self.grid.columns).then_some(Part {
                        row: self.rows.get(2 * y + step.1)?,
                        column,
                        recast,
                        weight: 1.0,
                    })
                });
                let blocks = joined(parts, terms, &mut row.moments);
                row.cells.push(blocks);
            }
            row
        });
        let most = grid
            .cells(|column, row| self.largest(2 * column..2 * column + 2, 2 * row..2 * row + 2));
        Self { grid, rows, most }
    }

    /// The fits, each from a cell and those around it.
    pub(super) fn fits(&self, basis: &Basis) -> FittedCells {
        let (grid, terms) = (self.grid, basis.len());
        let steps = [-1.0_f64, 0.0, 1.0];
        let weights = steps.map(|step| WEIGHT_BESIDE.powf(step.abs()));
        let beside = |along: fn(f64) -> (f64, f64)| {
            [0, 1, 2].map(|i| Recast::of(basis, 1.0, along(steps[i]), weights[i]))
        };
        let (across, down) = (beside(|step| (step, 0.0)), beside(|step| (0.0, step)));
        let aside = grid.rows(|y| {
            let mut row = Row::of(grid.columns, terms);
            for column in 0..grid.columns {
                let parts = (0..3).filter_map(|i| {
                    let column = (column + i).checked_sub(1)?;
                    (column < grid.columns).then_some(Part {
                        row: &self.rows[y],
                        column,
                        recast: &across[i],
                        weight: weights[i],
                    })
                });
                let blocks = joined(parts, terms, &mut row.moments);
                row.cells.push(blocks);
            }
            row
        });
        let fits = grid.rows(|y| {
            let mut moments = Vec::new();
            let of_cell = |column: usize| {
                let parts = (0..3).filter_map(|i| {
                    Some(Part {
                        row: aside.get((y + i).checked_sub(1)?)?,
                        column,
                        recast: &down[i],
                        weight: weights[i],
                    })
                });
                moments.clear();
                let blocks = joined(parts, terms, &mut moments);
                let fits = blocks.iter().map(|block| fit(block, terms, &mut moments));
                fits.flatten().collect()
            };
            (0..grid.columns).map(of_cell).collect::<Vec<Vec<Fit>>>()
        });
        FittedCells {
            grid,
            fits: fits.into_iter().flatten().collect(),
            seen: grid.cells(|column, row| {
                let around = |at: usize| at.saturating_sub(1)..at + 2;
                self.largest(around(column), around(row))
            }),
        }
    }

    /// Largest size of the layer's values in some columns and rows, as far as there are such.
    fn largest(&self, columns: Range<usize>, rows: Range<usize>) -> [f32; 3] {
        let mut most = [0.0; 3];
        for row in rows.start..rows.end.min(self.grid.rows) {
            for column in columns.start..columns.end.min(self.grid.columns) {
                most = larger(most, &self.most[row * self.grid.columns + column]);
            }
        }
        most
    }
}

/// Sums over cells, region by region, added to `moments`.
fn joined<'a>(
    parts: impl Iterator<Item = Part<'a>>,
    terms: usize,
    moments: &mut Vec<Lanes>,
) -> Vec<Block> {
    let mut all: Vec<Block> = Vec::new();
    for part in parts {
        for block in &part.row.cells[part.column] {
            let own = of_region(&mut all, block.region, terms, moments);
            own.pixels += part.weight * block.pixels;
            let start = own.start;
            let others = &part.row.moments[block.start..];
            add_recast(
                &mut moments[start..start + size(terms)],
                others,
                part.recast,
            );
        }
    }
    all
}

/// The block of a region in a list in order, to which it is added where it is not there yet.
fn of_region<'b>(
    blocks: &'b mut Vec<Block>,
    region: u32,
    terms: usize,
    moments: &mut Vec<Lanes>,
) -> &'b mut Block {
    let none = || {
        let start = moments.len();
        moments.resize(start + size(terms), ZERO);
        Block {
            region,
            pixels: 0.0,
            start,
        }
    };
    entry(blocks, region, |block| block.region, none)
}

/// The fit of a region; none of too few pixels. A surface of few has its first terms alone.
fn fit(block: &Block, terms: usize, moments: &mut [Lanes]) -> Option<Fit> {
    let count = ((block.pixels / PIXELS_PER_TERM) as usize).min(terms);
    let own = &mut moments[block.start..block.start + size(terms)];
    (count > 0).then(|| Fit {
        region: block.region,
        coefficients: solve(own, terms, count),
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

/// What the pixels of a cell say that show one region, with sums added to `moments`.
fn blocks(
    problem: &Problem<'_>,
    grid: Grid,
    cell: (usize, usize),
    moments: &mut Vec<Lanes>,
) -> Vec<Block> {
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
        let weight = lanes(|k, half| f64::from(problem.weights[half][pixel][k]));
        let block = of_region(&mut blocks, fragment.region, terms, moments);
        block.pixels += 1.0;
        let start = block.start;
        add(
            &mut moments[start..start + size(terms)],
            &row[..=terms],
            &weight,
        );
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

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::denoise::tests::{evenly_lit, guides, rendered};
    use crate::denoise::{basis, single};
    use crate::film::FilmLayer;

    /// Sums over cells of any size are the same whether they are made of smaller ones or of pixels.
    #[test]
    fn cells_are_what_their_quarters_are() {
        let scene = evenly_lit();
        let film = rendered(&scene, 2, 1);
        let guides = guides(&scene, &film);
        let values = single(film.layer(FilmLayer::Total));
        let weights = vec![[1.0, 2.0, 3.0]; values.len()];
        for basis in [Basis::of_veil(), Basis::of_straight(1)] {
            let problem = Problem {
                guides: &guides,
                blurred: &basis::blurred_light(&guides),
                basis: &basis,
                halves: [&values, &values],
                weights: [&weights, &weights],
                cancel: &AtomicBool::new(false),
            };
            let made = Summed::of(&problem, 8).expect("wanted").merged(&basis);
            let summed = Summed::of(&problem, 16).expect("wanted");
            assert_eq!((made.grid.columns, made.grid.rows), (4, 3));
            assert_eq!(made.most, summed.most);
            for (made, summed) in made.rows.iter().zip(&summed.rows) {
                let pairs = made.moments.iter().zip(&summed.moments);
                for (a, b) in pairs.flat_map(|(a, b)| a.iter().zip(b)) {
                    assert!((a - b).abs() <= 1e-9 * (1.0 + b.abs()), "{a} {b}");
                }
            }
        }
    }
}
