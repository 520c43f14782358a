//! What pixels at full scale would show if the sensor went on.
//!
//! Of a value that full scale cuts off it is known that it is larger. The brightest pixels of a patch that are not cut off tell how fast values grow rarer
//! there; beyond full scale that goes on as an exponential distribution. Which pixel has which of its values follows from where it lies: the middle of
//! a bright spot is brighter than its rim.

use uw_calib::stats::{PATCH_COLUMNS, PATCH_ROWS};

/// The brightest share of a patch that tells how its values go on: so many times the share at full scale ...
const TELLING_TIMES: f64 = 3.0;
/// ... but within these.
const TELLING: [f64; 2] = [0.2, 0.75];
/// Share at full scale up to which a patch tells how its own values go on.
const MOST_OF_PATCH: f64 = 0.5;
/// Radii of the neighbourhoods that tell how deep inside a bright spot a pixel lies, pixels.
const RADII_PX: [usize; 3] = [1, 4, 13];

/// A picture's values, of which some are cut off.
pub(super) struct CutOff<'a> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: &'a mut [f64],
    /// Which of them.
    pub(super) at_full: &'a [bool],
}

/// A patch with pixels at full scale.
struct Patch {
    pixels: Vec<usize>,
    /// Scale of the exponential distribution, as far as the patch tells it.
    scale: Option<f64>,
}

impl CutOff<'_> {
    /// Puts values beyond full scale in the place of those that are cut off, where any patch tells how its own go on.
    pub(super) fn restore(&mut self) {
        if !self.at_full.contains(&true) {
            return;
        }
        let patches: Vec<Patch> = (0..PATCH_ROWS * PATCH_COLUMNS)
            .filter_map(|i| self.patch(i % PATCH_COLUMNS, i / PATCH_COLUMNS))
            .collect();
        let known: Vec<f64> = patches.iter().filter_map(|patch| patch.scale).collect();
        let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
        let depths = Depths::new(self);
        for mut patch in patches {
            patch
                .pixels
                .sort_by_cached_key(|&pixel| depths.of(pixel % self.width, pixel / self.width));
            let scale = patch.scale.unwrap_or(mean);
            let n = patch.pixels.len() as f64;
            for (rank, &pixel) in patch.pixels.iter().enumerate() {
                let brighter = 1.0 - (rank as f64 + 0.5) / n;
                self.values[pixel] -= scale * brighter.ln();
            }
        }
    }

    /// The pixels of a patch that are cut off, if it has any.
    fn patch(&self, column: usize, row: usize) -> Option<Patch> {
        let edge = |i: usize, side: usize, n: usize| i * side / n;
        let rows = edge(row, self.height, PATCH_ROWS)..edge(row + 1, self.height, PATCH_ROWS);
        let columns =
            edge(column, self.width, PATCH_COLUMNS)..edge(column + 1, self.width, PATCH_COLUMNS);
        let all = rows.flat_map(|y| columns.clone().map(move |x| y * self.width + x));
        let (pixels, below): (Vec<usize>, Vec<usize>) = all.partition(|&i| self.at_full[i]);
        let n = pixels.len() + below.len();
        let share = pixels.len() as f64 / n as f64;
        (!pixels.is_empty()).then(|| Patch {
            scale: (share <= MOST_OF_PATCH).then(|| self.scale(&pixels, &below, share)),
            pixels,
        })
    }

    /// Scale of the exponential distribution of the brightest values of a patch.
    fn scale(&self, pixels: &[usize], below: &[usize], share: f64) -> f64 {
        let of = |i: &usize| self.values[*i];
        let full = pixels.iter().map(of).sum::<f64>() / pixels.len() as f64;
        let mut below: Vec<f64> = below.iter().map(of).collect();
        below.sort_by(f64::total_cmp);
        let telling = (TELLING_TIMES * share).clamp(TELLING[0], TELLING[1]);
        let n = pixels.len() + below.len();
        let from = ((1.0 - telling) * n as f64) as usize;
        let least = below.get(from).or(below.last()).copied().unwrap_or(full);
        ((full - least) / (telling / share).ln()).max(0.0)
    }
}

/// How many pixels around one are at full scale.
struct Depths {
    width: usize,
    height: usize,
    sums: Vec<u32>,
}

impl Depths {
    fn new(picture: &CutOff<'_>) -> Self {
        let (width, height) = (picture.width, picture.height);
        let mut sums = vec![0; (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = 0;
            for x in 0..width {
                row += u32::from(picture.at_full[y * width + x]);
                let at = (y + 1) * (width + 1) + x + 1;
                sums[at] = sums[at - (width + 1)] + row;
            }
        }
        Self {
            width,
            height,
            sums,
        }
    }

    /// The shares of its neighbourhoods, summed, in millionths.
    fn of(&self, x: usize, y: usize) -> u64 {
        let share = |&radius: &usize| {
            let (left, right) = (x.saturating_sub(radius), (x + radius + 1).min(self.width));
            let (top, bottom) = (y.saturating_sub(radius), (y + radius + 1).min(self.height));
            let at = |x: usize, y: usize| u64::from(self.sums[y * (self.width + 1) + x]);
            let sum = at(right, bottom) + at(left, top) - at(left, bottom) - at(right, top);
            1_000_000 * sum / ((right - left) * (bottom - top)) as u64
        };
        RADII_PX.iter().map(share).sum()
    }
}

#[cfg(test)]
mod tests;
