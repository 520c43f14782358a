//! What the fits say of every pixel: the mean of those of the four nearest cells, fragment by fragment.

use rayon::prelude::*;

use super::basis::{Carried, MOST_TERMS, View, power};
use super::cells::FittedCells;
use super::guides::{Fragment, NO_REGION};
use super::lanes::{Lanes, ZERO, add_product, add_scaled, crossed, lane};
use super::regions::entry;
use super::regression::{CROSSED, OWN, Problem, SHOWN, Values};

/// What a fit may say of a pixel, over the largest value of the layer in the cells that it was made from: beyond, it speaks of what it
/// has not seen.
const MOST_OF_SEEN: f64 = 1.5;
/// How far below no light it may come out, over the same.
const BELOW_NONE: f64 = 0.02;
/// Largest difference of the transmittances before two surfaces in a pixel of which one may follow the other's fit: the veils before them
/// are then alike.
const ALIKE: f32 = 0.05;

/// Of the carriers at a place, where there are fits.
#[derive(Default)]
struct Coefficients {
    are_known: bool,
    of: Carried,
}

/// What the fits of a region in a column of cells say along a row of pixels: the mean of those above and below.
struct Span {
    region: u32,
    /// Weight of the fits that there are.
    weight: f64,
    /// Weighted coefficients of carriers and powers of u.
    slopes: [Lanes; MOST_TERMS],
}

/// A size of cells along a row of pixels.
struct Line<'a> {
    cells: &'a FittedCells,
    /// The rows of cells above and below, and their weights.
    near_rows: [(usize, f64); 2],
    /// Column by column, regions in order.
    spans: Vec<Vec<Span>>,
}

/// A cell near a pixel: its column, its weight and the pixel's place in it.
type Near = (usize, f64, f64);

/// A fragment of a pixel with its carriers.
struct Viewed<'a> {
    fragment: &'a Fragment,
    shown: Carried,
    /// Where the samples looked, if they saw something else.
    sampled: Option<Carried>,
}

impl Problem<'_> {
    /// What the fits of each size of cells say, pixel by pixel.
    pub(super) fn values(&self, sizes: &[FittedCells]) -> Vec<Option<Values>> {
        let (width, height) = (self.guides.width, self.guides.height);
        let mut values = vec![None; width * height * sizes.len()];
        let rows = values.par_chunks_mut(width * sizes.len());
        rows.enumerate()
            .for_each(|(y, values)| self.row(sizes, y, values));
        values
    }

    /// The same of a row of pixels.
    fn row(&self, sizes: &[FittedCells], y: usize, values: &mut [Option<Values>]) {
        let lines: Vec<Line<'_>> = sizes.iter().map(|cells| self.line(cells, y)).collect();
        let (mut viewed, mut said) = (Vec::new(), Vec::new());
        for (x, values) in values.chunks_mut(sizes.len()).enumerate() {
            self.view((x, y), &mut viewed);
            for (line, value) in lines.iter().zip(values) {
                *value = self.value(line, (x, y), &viewed, &mut said);
            }
        }
    }

    fn line<'a>(&self, cells: &'a FittedCells, y: usize) -> Line<'a> {
        let grid = cells.grid;
        let near_rows = nearest(y, grid.cell_px, grid.rows);
        let of_column = |column: usize| {
            let mut spans: Vec<Span> = Vec::new();
            for (row, weight) in near_rows.into_iter().filter(|(_, weight)| *weight > 0.0) {
                let v = grid.place(y, row);
                for fit in &cells.fits[row * grid.columns + column] {
                    let none = || Span {
                        region: fit.region,
                        weight: 0.0,
                        slopes: [ZERO; MOST_TERMS],
                    };
                    let span = entry(&mut spans, fit.region, |span| span.region, none);
                    span.weight += weight;
                    let terms = self.basis.powers_of_v().zip(&fit.coefficients);
                    for ((slope, n), coefficients) in terms {
                        add_scaled(&mut span.slopes[slope], weight * power(v, n), coefficients);
                    }
                }
            }
            spans
        };
        Line {
            cells,
            near_rows,
            spans: (0..grid.columns).map(of_column).collect(),
        }
    }

    /// The fragments of a pixel with their carriers, each by its own region's light.
    fn view<'a>(&'a self, (x, y): (usize, usize), viewed: &mut Vec<Viewed<'a>>) {
        let pixel = y * self.guides.width + x;
        let varied = self.guides.is_varied(pixel);
        viewed.clear();
        viewed.extend(self.guides.pixel(pixel).iter().map(|fragment| {
            let blurred = &self.blurred[self.nearest_pure((x, y), fragment.region)];
            let carriers = |view| self.basis.carriers(fragment, blurred, view);
            Viewed {
                fragment,
                shown: carriers(View::Shown),
                sampled: varied.then(|| carriers(View::Sampled)),
            }
        }));
    }

    /// The values of a pixel: sums over its fragments of what the fits of the cells near it say; none where that is far from all that
    /// these have seen.
    fn value(
        &self,
        line: &Line<'_>,
        (x, y): (usize, usize),
        viewed: &[Viewed<'_>],
        said: &mut Vec<Coefficients>,
    ) -> Option<Values> {
        let grid = line.cells.grid;
        let near = nearest(x, grid.cell_px, grid.columns)
            .map(|(column, weight)| (column, weight, grid.place(x, column)));
        said.resize_with(viewed.len(), Coefficients::default);
        for (own, said) in viewed.iter().zip(said.iter_mut()) {
            self.say(line, &near, own.fragment.region, said);
        }
        let mut sum = [ZERO; 3];
        for (own, coefficients) in viewed.iter().zip(said.iter()) {
            match coefficients.are_known {
                true => self.add(&mut sum, own, coefficients),
                false => {
                    let (other, coefficients) = stand_in(own.fragment, viewed, said)?;
                    let beside = self.view_beside(own, other, (x, y));
                    self.add(&mut sum, &beside, coefficients);
                }
            }
        }
        if viewed.iter().all(|own| own.sampled.is_none()) {
            (sum[OWN], sum[CROSSED]) = (sum[SHOWN], sum[SHOWN]);
        }
        let mut values = [[[0.0; 3]; 2]; 3];
        for (values, lanes) in values.iter_mut().zip(&sum) {
            for (half, values) in values.iter_mut().enumerate() {
                (0..3).for_each(|k| values[k] = lanes[lane(k, half)] as f32);
            }
        }
        self.is_near(line, &near, &sum).then_some(values)
    }

    /// Whether values are not far from what the fits near a pixel have seen.
    fn is_near(&self, line: &Line<'_>, near: &[Near; 2], values: &[Lanes; 3]) -> bool {
        let cells = line.cells;
        let mut seen = [0.0_f32; 3];
        for (row, _) in line.near_rows {
            for (column, ..) in near {
                let own = cells.seen[row * cells.grid.columns + column];
                (0..3).for_each(|k| seen[k] = seen[k].max(own[k]));
            }
        }
        (0..3).all(|k| {
            let seen = f64::from(seen[k]);
            let range = -BELOW_NONE * seen..=MOST_OF_SEEN * seen;
            let is_near = |way: &Lanes| (0..2).all(|half| range.contains(&way[lane(k, half)]));
            values.iter().all(is_near)
        })
    }

    /// Makes of `said` the mean of the fits of a region in the cells near a pixel.
    fn say(&self, line: &Line<'_>, near: &[Near; 2], region: u32, said: &mut Coefficients) {
        said.are_known = false;
        if region == NO_REGION {
            return;
        }
        let found = near.map(|(column, share, u)| {
            let spans = &line.spans[column];
            let index = spans.binary_search_by_key(&region, |span| span.region);
            let span = index.ok().map(|index| &spans[index]);
            span.filter(|_| share > 0.0).map(|span| (span, share, u))
        });
        let known = || found.iter().flatten();
        let weight: f64 = known().map(|(span, share, _)| share * span.weight).sum();
        said.are_known = weight > 0.0;
        said.of[..self.basis.carrier_count()].fill(ZERO);
        for &(span, share, u) in known() {
            let factors = [0, 1, 2].map(|n| share / weight * power(u, n));
            for (&(carrier, n), slope) in self.basis.slopes().iter().zip(&span.slopes) {
                add_scaled(&mut said.of[carrier], factors[usize::from(n)], slope);
            }
        }
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

    /// A fragment that follows the fit of another one, with carriers to go with it.
    fn view_beside<'a>(
        &self,
        own: &Viewed<'a>,
        other: &Fragment,
        place: (usize, usize),
    ) -> Viewed<'a> {
        let blurred = &self.blurred[self.nearest_pure(place, other.region)];
        let beside = |view| (self.basis).carriers_beside(own.fragment, other, blurred, view);
        Viewed {
            fragment: own.fragment,
            shown: beside(View::Shown),
            sampled: own.sampled.is_some().then(|| beside(View::Sampled)),
        }
    }

    /// Adds what `coefficients` say of a fragment in every way; where samples have seen nothing else, only all over the pixel.
    #[inline]
    fn add(&self, sum: &mut [Lanes; 3], viewed: &Viewed<'_>, coefficients: &Coefficients) {
        let known = || coefficients.of.iter().take(self.basis.carrier_count());
        for (own, carrier) in known().zip(&viewed.shown) {
            add_product(&mut sum[SHOWN], own, carrier);
        }
        for (own, carrier) in known().zip(viewed.sampled.iter().flatten()) {
            add_product(&mut sum[OWN], own, carrier);
            add_product(&mut sum[CROSSED], own, &crossed(carrier));
        }
    }
}

/// The fragment whose fit one without a fit follows, such as a speck far away: the largest one in its pixel that has a fit and
/// about the same water before it.
fn stand_in<'c>(
    fragment: &Fragment,
    all: &[Viewed<'c>],
    coefficients: &'c [Coefficients],
) -> Option<(&'c Fragment, &'c Coefficients)> {
    let share = |fragment: &Fragment| fragment.shown[0].share + fragment.shown[1].share;
    let alike = |other: &Fragment| {
        let pairs = fragment.shown.iter().zip(&other.shown);
        pairs
            .flat_map(|(a, b)| a.transmittance.iter().zip(&b.transmittance))
            .all(|(a, b)| (a - b).abs() <= ALIKE)
    };
    let known = all.iter().map(|viewed| viewed.fragment).zip(coefficients);
    known
        .filter(|(other, own)| own.are_known && alike(other))
        .max_by(|(a, _), (b, _)| share(a).total_cmp(&share(b)))
}

/// The two nearest of `count` cells and their weights.
fn nearest(pixel: usize, cell_px: usize, count: usize) -> [(usize, f64); 2] {
    let at = ((pixel as f64 + 0.5) / cell_px as f64 - 0.5).clamp(0.0, (count - 1) as f64);
    let first = (at as usize).min(count - 1);
    let second = (first + 1).min(count - 1);
    let part = at - first as f64;
    [(first, 1.0 - part), (second, part)]
}
