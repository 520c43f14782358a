//! Variance of a sensor's noise in a stored picture: from what is known of the sensor, or from the picture.
//!
//! **Known sensor.** The variance a·y + b of the linear signal goes through clipping, encoding and rounding in closed form
//! ([`crate::response`]), as a function of the mean count. Rounding adds 1/12 of a squared count to every pixel that is not
//! clipped: exact where the noise is above half a count, right on average over the texture's levels below that.
//!
//! **From the picture.** Immerkær's difference of two Laplacians (Computer Vision and Image Understanding 64 (1996), 300),
//! [1 -2 1; -2 4 -2; 1 -2 1], answers to neither level nor slope of a picture; the mean of its square over 36 is the variance of
//! noise that is independent from pixel to pixel, whatever its distribution. It is taken in cells of 8 × 8 pixels, of which the median among
//! cells of about the same level counts: edges and textured spots do not, as long as half of the cells of that level are smooth at
//! the scale of a pixel. Texture of that scale all over counts as noise, so the estimate is an upper bound there. Demosaicing,
//! denoising and JPEG make neighbours alike: then it is too small, and only a known sensor helps.

use crate::Encoding;
use crate::response::{LinearNoise, entry_signal, moments, normal_cdf, thresholds};

/// Entries of the table of a known sensor.
const ENTRIES: usize = 1024;
/// Levels a count of that table, so that rounding to them is nothing beside rounding to counts.
const LEVELS_PER_COUNT: usize = 8;
/// Side of the cells in which the noise is measured, pixels.
const CELL_PX: usize = 8;
/// Cells of about the same level whose median is taken.
const CELLS_PER_LEVEL: usize = 64;
/// Most levels.
const MAX_LEVELS: usize = 16;
/// Sum of the squared correlations of the operator's answers at all distances, (70/36)²: so many answers are worth one.
const CORRELATED: f64 = 3.780_864;

/// Where the variance of the noise is taken from.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum NoiseModel {
    /// Differences of neighbouring pixels.
    #[default]
    Picture,
    /// What is known of the sensor.
    Sensor(SensorNoise),
}

/// The same without its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseSource {
    /// Differences of neighbouring pixels.
    Picture,
    /// What is known of the sensor.
    Sensor,
}

impl NoiseModel {
    /// Where it takes the variance from.
    pub fn source(&self) -> NoiseSource {
        match self {
            Self::Picture => NoiseSource::Picture,
            Self::Sensor(_) => NoiseSource::Sensor,
        }
    }
}

impl NoiseSource {
    /// Its name in files and replies.
    pub fn name(self) -> &'static str {
        match self {
            Self::Picture => "picture",
            Self::Sensor => "sensor",
        }
    }
}

/// Variance of the stored count by its mean, of a sensor whose noise is known. White balance and colour matrix must be none: they
/// scale and mix the noise of the channels.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorNoise {
    /// By rising mean.
    table: Vec<Entry>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    /// Mean count.
    mean: f64,
    /// Variance of the count without rounding.
    variance: f64,
    /// Share of the pixels that are not clipped.
    rounded: f64,
}

impl SensorNoise {
    /// Of a sensor of this encoding; `None` unless `a` and `b` of the noise are finite and >= 0.
    pub fn new(encoding: Encoding, noise: LinearNoise) -> Option<Self> {
        if !(noise.a >= 0.0 && noise.b >= 0.0 && noise.a.is_finite() && noise.b.is_finite()) {
            return None;
        }
        let thresholds = thresholds(encoding, 255 * LEVELS_PER_COUNT);
        let unit = LEVELS_PER_COUNT as f64;
        let entry = |i: usize| {
            let signal = entry_signal(i, ENTRIES);
            let (mean, variance) = moments(signal, noise, &thresholds);
            let deviation = noise.standard_deviation(signal);
            let below = |bound: f64| match deviation > 0.0 {
                true => normal_cdf((bound - signal) / deviation),
                false => f64::from(u8::from(signal <= bound)),
            };
            Entry {
                mean: mean / unit,
                variance: (variance / (unit * unit) - 1.0 / (12.0 * unit * unit)).max(0.0),
                rounded: (below(1.0) - below(0.0)).max(0.0),
            }
        };
        let mut table: Vec<Entry> = (0..=ENTRIES).map(entry).collect();
        // The distribution function is exact to 1.5e-7 only.
        table.sort_by(|x, y| x.mean.total_cmp(&y.mean));
        Some(Self { table })
    }

    /// Variance, squared counts, where the mean count is `mean` and rounding is to multiples of `step` counts.
    ///
    /// Below the mean of black it goes on in a straight line, down to 0: the mean of a patch scatters to both sides.
    fn at(&self, mean: f64, step: f64) -> f64 {
        let after = self.table.partition_point(|entry| entry.mean < mean);
        let after = after.clamp(1, self.table.len() - 1);
        let (one, other) = (self.table[after - 1], self.table[after]);
        let width = other.mean - one.mean;
        let t = if width > 0.0 {
            ((mean - one.mean) / width).min(1.0)
        } else {
            0.0
        };
        let between = |x: f64, y: f64| x + t * (y - x);
        let rounded = between(one.rounded, other.rounded).clamp(0.0, 1.0);
        between(one.variance, other.variance).max(0.0) + rounded * step * step / 12.0
    }

    /// Mean variance of the noise over a patch of this mean and total variance.
    ///
    /// The variance differs from level to level, so it is averaged over the patch's own levels: those of a normal distribution
    /// with the variance that is left, at its three Gauss-Hermite points, which is exact for variances that are polynomials of
    /// the fifth degree.
    pub(crate) fn of_patch(&self, mean: f64, total: f64, step: f64) -> f64 {
        let mut noise = self.at(mean, step);
        for _ in 0..3 {
            let reach = (3.0 * (total - noise).max(0.0)).sqrt();
            let at = |level: f64| self.at(level, step);
            noise = (4.0 * at(mean) + at(mean - reach) + at(mean + reach)) / 6.0;
        }
        noise
    }
}

/// Noise of a channel found in the picture.
pub(crate) struct Estimated {
    /// Mean variance of each patch, squared counts; NaN of patches without a cell that is known all over.
    pub patches: Vec<f64>,
    /// Level and variance, by rising level.
    levels: Vec<(f64, f64)>,
    /// Relative standard error at a level, which the patches of that level share.
    pub of_level: f64,
    /// Relative standard error of the mean over all levels.
    pub of_all: f64,
}

impl Estimated {
    /// Variance at a level, squared counts.
    pub fn at(&self, level: f64) -> f64 {
        between(&self.levels, level)
    }
}

/// Patches of `width` × `height` pixels that begin at the pixels `corners`, of a picture with rows of `stride` pixels.
pub(crate) struct Tiles<'a> {
    pub corners: &'a [usize],
    pub width: usize,
    pub height: usize,
    pub stride: usize,
}

/// Level and noise of a cell, and its patch.
#[derive(Clone, Copy)]
struct Cell {
    patch: usize,
    level: f64,
    variance: f64,
}

/// The noise of a channel; `None` where patches are smaller than 3 × 3 pixels, or no cell is known all over.
pub(crate) fn estimate(tiles: &Tiles, plane: &[f64]) -> Option<Estimated> {
    let (across, down) = (tiles.width.checked_sub(2)?, tiles.height.checked_sub(2)?);
    if across == 0 || down == 0 {
        return None;
    }
    let side = [across.min(CELL_PX), down.min(CELL_PX)];
    let mut cells = Vec::new();
    for (patch, corner) in tiles.corners.iter().enumerate() {
        for y in (0..=down - side[1]).step_by(side[1]) {
            for x in (0..=across - side[0]).step_by(side[0]) {
                // The operator's middle is a pixel inside the patch.
                let first = corner + (y + 1) * tiles.stride + x + 1;
                let cell = cell(patch, first, side, tiles.stride, plane);
                cells.extend((!cell.variance.is_nan()).then_some(cell));
            }
        }
    }
    if cells.is_empty() {
        return None;
    }
    let freedom = ((side[0] * side[1]) as f64 / CORRELATED).max(1.0);
    cells.sort_by(|x, y| x.level.total_cmp(&y.level));
    let count = (cells.len() / CELLS_PER_LEVEL).clamp(1, MAX_LEVELS);
    let levels = levels(&cells, count, freedom);
    let mut sums = vec![(0.0, 0.0); tiles.corners.len()];
    for cell in &cells {
        let sum = &mut sums[cell.patch];
        *sum = (sum.0 + between(&levels, cell.level), sum.1 + 1.0);
    }
    // The standard error of a median is sqrt(π/2) of the mean's.
    let error = |cells: f64| (std::f64::consts::PI / (freedom * cells)).sqrt();
    Some(Estimated {
        patches: sums.into_iter().map(|(sum, n)| sum / n).collect(),
        levels,
        of_level: error(cells.len() as f64 / count as f64),
        of_all: error(cells.len() as f64),
    })
}

fn cell(patch: usize, first: usize, side: [usize; 2], stride: usize, plane: &[f64]) -> Cell {
    let [width, height] = side;
    // With a pixel more to all sides.
    let row = |y: usize| {
        let from = first + y * stride - stride - 1;
        &plane[from..from + width + 2]
    };
    let (mut levels, mut energies) = ([0.0; CELL_PX], [0.0; CELL_PX]);
    let mut before = [differences(row(0)), differences(row(1))];
    for y in 0..height {
        let next = differences(row(y + 2));
        for x in 0..CELL_PX {
            let difference = before[0][x] - 2.0 * before[1][x] + next[x];
            energies[x] += difference * difference;
        }
        for (level, value) in levels.iter_mut().zip(&row(y + 1)[1..=width]) {
            *level += value;
        }
        before = [before[1], next];
    }
    let count = (width * height) as f64;
    Cell {
        patch,
        level: levels.iter().sum::<f64>() / count,
        variance: energies.iter().sum::<f64>() / (36.0 * count),
    }
}

/// Second differences along a row of a cell; 0 beyond a narrow one.
fn differences(row: &[f64]) -> [f64; CELL_PX] {
    let second = |at: &[f64], x: usize| at[x] - 2.0 * at[x + 1] + at[x + 2];
    match row.first_chunk::<{ CELL_PX + 2 }>() {
        Some(row) => std::array::from_fn(|x| second(row, x)),
        None => std::array::from_fn(|x| {
            if x + 2 < row.len() {
                second(row, x)
            } else {
                0.0
            }
        }),
    }
}

/// Level and noise of `count` parts of the cells, which rise in level.
fn levels(cells: &[Cell], count: usize, freedom: f64) -> Vec<(f64, f64)> {
    // Median of a chi-squared distribution over its mean (Wilson and Hilferty).
    let median_share = (1.0 - 2.0 / (9.0 * freedom)).powi(3);
    (0..count)
        .map(|k| {
            let part = &cells[k * cells.len() / count..(k + 1) * cells.len() / count];
            let level = part.iter().map(|cell| cell.level).sum::<f64>() / part.len() as f64;
            let mut variances: Vec<f64> = part.iter().map(|cell| cell.variance).collect();
            let (_, median, _) = variances.select_nth_unstable_by(part.len() / 2, f64::total_cmp);
            (level, *median / median_share)
        })
        .collect()
}

/// The noise at a level: linear between those known, the outermost beyond them.
fn between(levels: &[(f64, f64)], level: f64) -> f64 {
    let after = levels.partition_point(|known| known.0 < level);
    let last = levels.len() - 1;
    let (one, other) = (levels[after.saturating_sub(1)], levels[after.min(last)]);
    if other.0 > one.0 {
        one.1 + (level - one.0) / (other.0 - one.0) * (other.1 - one.1)
    } else {
        one.1
    }
}
