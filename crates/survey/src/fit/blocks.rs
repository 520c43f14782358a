//! The part of the target that every picture shows, as means over blocks of pixels.

use uw_calib::Encoding;
use uw_calib::picture::Counts;
use uw_calib::response::LinearNoise;

/// Most blocks across and down the part that all pictures show.
const MOST_BLOCKS: [usize; 2] = [12, 8];
/// Most times that all blocks are as wide as those of the nearest picture: light of the surroundings scatters into the view.
const MOST_WIDER: usize = 4;
/// Least side of a block in the farthest picture, pixels: a smaller one is little else than noise and edges of pixels.
const LEAST_BLOCK_PX: f64 = 5.0;
/// Count from which a pixel says nothing of how much light there was.
const FULL_COUNT: f64 = 254.5;
/// Variance of rounding, squares of a count.
const ROUNDING: f64 = 1.0 / 12.0;

/// Blocks of the target's plane: the inner ones divide what the nearest picture shows, the outer ones are as large and go on
/// around them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    /// Columns and rows of all blocks.
    pub(super) size: [usize; 2],
    /// Columns and rows of the inner ones.
    inner: [usize; 2],
}

/// Linear signal of a block: mean, and variance of that mean by the sensor's noise; infinite where pixels are at full scale, masked or not seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Block {
    pub(super) signal: [f64; 3],
    pub(super) variance: [f64; 3],
}

impl Grid {
    /// For pictures of `size_px` whose middle, `share` as wide and high, shows what the nearest picture shows.
    pub(super) fn new(size_px: [usize; 2], share: f64) -> Option<Self> {
        let inner = [0, 1].map(|axis| {
            let most = share * size_px[axis] as f64 / LEAST_BLOCK_PX;
            // Even, so that as many blocks are on either side.
            (most as usize).min(MOST_BLOCKS[axis]) / 2 * 2
        });
        let wider = ((1.0 / share) as usize).clamp(1, MOST_WIDER);
        let size = inner.map(|n| n * wider);
        inner
            .iter()
            .all(|n| *n >= 2)
            .then_some(Self { size, inner })
    }

    /// How many times as wide as the inner blocks all are.
    pub(super) fn wider(self) -> f64 {
        (self.size[0] / self.inner[0]) as f64
    }

    /// Number of all blocks.
    pub(super) fn len(self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Bounds of block `i` across and down, in halves of what the nearest picture shows, from its middle.
    fn bounds(self, i: usize) -> [[f64; 2]; 2] {
        [0, 1].map(|axis| {
            let place = [i % self.size[0], i / self.size[0]][axis] as f64;
            let first = -((self.size[axis] / self.inner[axis]) as f64);
            let side = 2.0 / self.inner[axis] as f64;
            [first + side * place, first + side * (place + 1.0)]
        })
    }

    /// Middle of block `i`, in the same unit; blocks go row by row from the top left.
    pub(super) fn middle(self, i: usize) -> (f64, f64) {
        let [u, v] = self.bounds(i).map(|[from, to]| 0.5 * (from + to));
        (u, v)
    }

    /// Half the side of an inner block across and down, in the same unit.
    pub(super) fn half(self) -> (f64, f64) {
        (1.0 / self.inner[0] as f64, 1.0 / self.inner[1] as f64)
    }

    /// Whether the nearest picture shows block `i`.
    pub(super) fn is_inner(self, i: usize) -> bool {
        let (u, v) = self.middle(i);
        u.abs() < 1.0 && v.abs() < 1.0
    }

    /// Blocks that a picture shows whole, of whose middle the nearest picture shows as much as `share` tells.
    pub(super) fn shown(self, share: f64) -> Vec<usize> {
        let most = (1.0 + 1e-9) / share;
        let whole = |i: &usize| {
            let bounds = self.bounds(*i);
            bounds.as_flattened().iter().all(|edge| edge.abs() <= most)
        };
        (0..self.len()).filter(whole).collect()
    }

    /// Block `i` of a picture, of whose middle the nearest picture shows as much as `share` tells.
    pub(super) fn measure(
        self,
        i: usize,
        picture: &Counts,
        share: f64,
        behind: Behind<'_>,
    ) -> Block {
        let [x, y] = self.bounds(i);
        let pixels = |edge: f64, side: usize| 0.5 * side as f64 * (1.0 + share * edge);
        block(
            picture,
            x.map(|edge| pixels(edge, picture.width)),
            y.map(|edge| pixels(edge, picture.height)),
            behind,
        )
    }
}

/// How a camera stores light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensor {
    pub(super) encoding: Encoding,
    pub(super) noise: LinearNoise,
}

/// What is behind a pixel that was made of stored ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stored {
    /// The share of its light that they have, by lens and exposure.
    pub(super) share: f64,
    /// How many they are.
    pub(super) pixels: f64,
}

/// A sensor, and what is behind pixels at a place, pixels from the top left corner.
type Behind<'a> = (&'a Sensor, &'a dyn Fn([f64; 2]) -> Stored);

/// Pixels that an interval covers, and how much of each.
fn covered([from, to]: [f64; 2], side: usize) -> impl Iterator<Item = (usize, f64)> + Clone {
    let last = (to.ceil() as usize).min(side);
    (from.max(0.0) as usize..last).map(move |i| {
        let i0 = i as f64;
        (i, (to.min(i0 + 1.0) - from.max(i0)).max(0.0))
    })
}

fn block(picture: &Counts, x: [f64; 2], y: [f64; 2], (sensor, stored): Behind<'_>) -> Block {
    let (mut sum, mut weights, mut squares) = ([0.0; 3], 0.0, 0.0);
    let mut unknown = [false; 3];
    let columns = covered(x, picture.width);
    for (row, of_row) in covered(y, picture.height) {
        for (column, of_column) in columns.clone() {
            let weight = of_row * of_column;
            let counts = picture.pixels[row * picture.width + column];
            for k in 0..3 {
                match counts[k] {
                    masked if masked.is_nan() => unknown[k] = true,
                    counts => {
                        sum[k] += weight * sensor.encoding.light(counts);
                        unknown[k] |= counts >= FULL_COUNT;
                    }
                }
            }
            weights += weight;
            squares += weight * weight;
        }
    }
    let signal = sum.map(|s| s / weights);
    let Stored {
        share: left,
        pixels,
    } = stored([x, y].map(|[from, to]| 0.5 * (from + to)));
    let variance = [0, 1, 2].map(|k| {
        let y = signal[k];
        let stored = left * y;
        let of_pixel = sensor.noise.a * stored + sensor.noise.b;
        let rounding = ROUNDING / sensor.encoding.slope(stored).powi(2);
        match unknown[k] {
            true => f64::INFINITY,
            false => (of_pixel + rounding) * squares / (pixels * (weights * left).powi(2)),
        }
    });
    Block { signal, variance }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSOR: Sensor = Sensor {
        encoding: Encoding::Linear,
        noise: LinearNoise { a: 0.0, b: 1e-4 },
    };

    const BEHIND: Behind<'_> = (&SENSOR, &|_| Stored {
        share: 1.0,
        pixels: 1.0,
    });

    fn ramp(width: usize, height: usize) -> Counts {
        let value = |i: usize| (i % width) as f64 + 2.0 * (i / width) as f64;
        Counts::stored(
            width,
            height,
            (0..width * height).map(|i| [value(i); 3]).collect(),
        )
    }

    /// Of a ramp every block has the value of its middle, whole pixels or not.
    #[test]
    fn blocks_are_means_over_their_part_of_the_picture() {
        let picture = ramp(90, 50);
        let share = 0.43;
        let grid = Grid::new([90, 50], share).expect("a grid");
        assert_eq!((grid.inner, grid.size), ([6, 4], [12, 8]));
        let shown = grid.shown(share);
        assert_eq!(shown.len(), grid.len());
        for i in shown {
            let block = grid.measure(i, &picture, share, BEHIND);
            let (u, v) = grid.middle(i);
            let (x, y) = (
                45.0 * (1.0 + share * u) - 0.5,
                25.0 * (1.0 + share * v) - 0.5,
            );
            // A pixel's value is its own everywhere in it, so that a cut pixel leaves up to 1/8 of its step.
            let error = 255.0 * block.signal[1] - (x + 2.0 * y);
            assert!(error.abs() < 0.2, "{i}: {error}");
        }
    }

    #[test]
    fn the_nearest_picture_shows_the_inner_blocks_and_others_more() {
        let grid = Grid::new([640, 480], 0.25).expect("a grid");
        assert_eq!((grid.inner, grid.size), ([12, 8], [48, 32]));
        let inner: Vec<usize> = (0..grid.len()).filter(|i| grid.is_inner(*i)).collect();
        assert_eq!(grid.shown(1.0), inner);
        assert_eq!(grid.shown(0.5).len(), 4 * inner.len());
        assert_eq!(Grid::new([80, 80], 0.1), None);
    }

    #[test]
    fn the_mean_of_many_pixels_is_known_better_and_full_ones_are_not_known() {
        let mut picture = ramp(80, 80);
        picture.pixels[0] = [255.0, 3.0, 3.0];
        let grid = Grid::new([80, 80], 1.0).expect("a grid");
        let first = grid.measure(0, &picture, 1.0, BEHIND);
        assert!(first.variance[0].is_infinite() && first.variance[1].is_finite());
        let pixels = (80.0 / 12.0) * 10.0;
        let of_pixel = 1e-4 + ROUNDING / (255.0 * 255.0);
        let other = grid.measure(5, &picture, 1.0, BEHIND);
        // Cut pixels count less.
        assert!((other.variance[2] / (of_pixel / pixels) - 1.0).abs() < 0.1);
        // The mean of nine frames that were exposed half as long.
        let stored = |_| Stored {
            share: 0.5,
            pixels: 9.0,
        };
        let better = grid.measure(5, &picture, 1.0, (&SENSOR, &stored));
        assert!((better.variance[2] / other.variance[2] * 9.0 / 4.0 - 1.0).abs() < 1e-9);
        // Masked ones are not known either.
        picture.pixels[70] = [f64::NAN; 3];
        let masked = grid.measure(10, &picture, 1.0, BEHIND);
        assert!(masked.variance.iter().all(|v| v.is_infinite()) && masked.signal[0].is_finite());
    }
}
