//! How bright an earlier picture says that the present one must be.
//!
//! Detail tells a wrong water badly: another part of the target may be before the camera, and farther by it shows surroundings
//! that were not seen. Where both pictures show the same part, its mean reflectance is the same, and what water, light and
//! exposure make of it is told to the error of the tables and distances.

use uw_calib::Encoding;
use uw_calib::response::LinearNoise;

use super::blocks::{Blocks, Cell};
use super::light::Seen;
use super::overlap::overlap;

/// Error of the tables, as a share of veil and of the target's light.
const TABLES: f64 = 0.01;
/// Error of a distance: of itself as a share, and m.
const DISTANCE: [f64; 2] = [0.01, 0.02];
/// How much the mean reflectance of one part of a target differs from that of another at least, as a share.
const OTHER_PART: f64 = 0.15;
/// Blocks of a match that stand for one independent one: what misplaces one misplaces its neighbours.
const ALIKE: f64 = 9.0;
/// Blocks of a match across a picture, out of those of [`Blocks`].
const MERGED: f64 = 2.0;
/// Error that the rounding of counts leaves, 8-bit counts.
const ROUNDING_COUNTS: f64 = 0.05;
/// Relative step by which the change with the distance is measured.
pub(super) const STEP: f64 = 0.01;

/// A picture in blocks at its place.
pub(super) struct Look<'a> {
    pub(super) blocks: Blocks,
    /// Distance, m.
    pub(super) distance_m: f64,
    /// The light there, and from farther by [`STEP`].
    pub(super) seen: [Seen<'a>; 2],
    /// Channels that are clipped or of another light.
    pub(super) useless: [bool; 3],
    /// Patch-to-patch spread of the reflectance over its mean.
    pub(super) spread: [f64; 3],
    /// Variance of the signal y of a pixel as it was stored: a·y + b.
    pub(super) noise: LinearNoise,
}

/// The sensor that both pictures are of.
pub(super) struct Sensor {
    pub(super) encoding: Encoding,
    /// Half the field of view across, as a tangent.
    pub(super) half_view: f64,
}

/// Mean counts of the part of the target that both pictures show, or of the whole picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brightness {
    /// Predicted less measured per channel, 8-bit counts; `None` where a picture is clipped or no target is as bright or dark.
    pub counts: [Option<f64>; 3],
    /// Its standard error, 8-bit counts: of tables, distances, and the part of the target that is seen.
    pub error_counts: [f64; 3],
    /// Whether both pictures were found to show the same part of the target.
    pub same_part: bool,
}

/// What an earlier picture predicts for a present one, less what that has; `None` where no channel tells.
pub(super) fn brightness(earlier: &Look, present: &Look, sensor: &Sensor) -> Option<Brightness> {
    let told = [0, 1, 2].map(|k| !earlier.useless[k] && !present.useless[k]);
    let is_nearer = earlier.distance_m <= present.distance_m;
    let (near, far) = match is_nearer {
        true => (earlier, present),
        false => (present, earlier),
    };
    let near_blocks = near
        .blocks
        .merged(MERGED * far.distance_m / near.distance_m);
    let far_blocks = far.blocks.merged(MERGED);
    let best = (0..3).filter(|&k| told[k]).max_by(|&a, &b| {
        let clear = |k: usize| shown(&far_blocks, k, far.noise);
        clear(a).total_cmp(&clear(b))
    })?;
    let found = overlap(&near_blocks, &far_blocks, best);
    let block_m = 2.0 * sensor.half_view * far.distance_m / far_blocks.columns as f64;
    let mut result = Brightness {
        counts: [None; 3],
        error_counts: [0.0; 3],
        same_part: found.is_some(),
    };
    for k in (0..3).filter(|&k| told[k]) {
        let (pairs, error) = match &found {
            Some(found) => {
                let pair = |&(i, j): &(usize, usize)| {
                    let (near, far) = (near_blocks.cells[i][k], far_blocks.cells[j][k]);
                    match is_nearer {
                        true => (near, far),
                        false => (far, near),
                    }
                };
                let pairs: Vec<_> = found.pairs.iter().map(pair).collect();
                let width_m = (pairs.len() as f64).sqrt() * block_m;
                (pairs, PartError::Same { width_m })
            }
            None => (whole(earlier, present, k), PartError::Other),
        };
        let compared = Compared::new(&pairs, k, (earlier, present), sensor, &error);
        result.counts[k] = Some(compared.off);
        result.error_counts[k] = compared.error;
    }
    Some(result)
}

/// Variance of a channel's blocks over that of its noise.
fn shown(blocks: &Blocks, k: usize, noise: LinearNoise) -> f64 {
    let n = blocks.cells.len() as f64;
    let mean = blocks
        .cells
        .iter()
        .map(|block| block[k].signal)
        .sum::<f64>()
        / n;
    let square = |block: &[Cell; 3]| (block[k].signal - mean).powi(2);
    let variance = blocks.cells.iter().map(square).sum::<f64>() / n;
    variance / (noise.a * mean + noise.b).max(f64::MIN_POSITIVE)
}

/// The earlier picture's mean reflectance beside each block of the present one.
fn whole(earlier: &Look, present: &Look, k: usize) -> Vec<(Cell, Cell)> {
    let n = earlier.blocks.cells.len() as f64;
    let mut mean = Cell::default();
    for block in &earlier.blocks.cells {
        mean.veil += block[k].veil / n;
        mean.gain += block[k].gain / n;
    }
    mean.signal = mean.veil + mean.gain * earlier.blocks.reflectance(k);
    let blocks = present.blocks.cells.iter();
    blocks.map(|block| (mean, block[k])).collect()
}

/// What is open of the target's mean reflectance.
enum PartError {
    /// The same part, as wide, m.
    Same { width_m: f64 },
    /// Perhaps another.
    Other,
}

/// One channel compared, 8-bit counts.
struct Compared {
    off: f64,
    error: f64,
}

impl Compared {
    fn new(
        pairs: &[(Cell, Cell)],
        k: usize,
        (earlier, present): (&Look, &Look),
        sensor: &Sensor,
        part: &PartError,
    ) -> Self {
        let n = pairs.len() as f64;
        let mean = |of: &dyn Fn(&(Cell, Cell)) -> f64| pairs.iter().map(of).sum::<f64>() / n;
        let target = |(a, b): &(Cell, Cell)| b.gain * a.reflectance();
        let (veil, light) = (mean(&|(_, b)| b.veil), mean(&target));
        let before = mean(&|(a, b)| a.veil * b.gain / a.gain);
        let (predicted, measured) = (veil + light, mean(&|(_, b)| b.signal));
        let misses = |pair: &(Cell, Cell)| {
            (pair.1.veil + target(pair) - pair.1.signal - predicted + measured).powi(2)
        };
        let scatter = mean(&misses).sqrt();
        let of_tables = TABLES * veil.hypot(before).hypot(light).hypot(light);
        let of_distances = moved(present, k, veil, light).hypot(moved(earlier, k, before, light));
        let spread = earlier.spread[k].max(present.spread[k]);
        let of_part = match *part {
            PartError::Other => light * spread.hypot(OTHER_PART),
            PartError::Same { width_m } => {
                // Rays that scatter see the surroundings as well.
                let beyond = |look: &Look| 1.0 - look.seen[0].left_of(k, 1.0 / width_m);
                let around = light * spread * beyond(earlier).hypot(beyond(present));
                around.hypot(scatter / (n / ALIKE).max(1.0).sqrt())
            }
        };
        let error = of_tables.hypot(of_distances).hypot(of_part);
        let error = error.hypot(cut_off(measured, present.noise));
        let counts = |signal: f64| sensor.encoding.counts(signal);
        let rise = 0.5 * (counts(predicted + error) - counts(predicted - error));
        Self {
            off: counts(predicted) - counts(measured),
            error: rise.hypot(ROUNDING_COUNTS),
        }
    }
}

/// What the error of a distance makes of a veil and the light of a target.
fn moved(look: &Look, k: usize, veil: f64, light: f64) -> f64 {
    let change = |of: fn(&Seen, usize) -> f64| {
        let [here, farther] = [0, 1].map(|i| of(&look.seen[i], k));
        (farther / here.max(f64::MIN_POSITIVE) - 1.0) / STEP
    };
    let by_distance = veil * change(|seen, k| seen.veil[k].iter().sum())
        + light * change(|seen, k| seen.gain[k].iter().sum());
    by_distance.abs() * DISTANCE[0].hypot(DISTANCE[1] / look.distance_m)
}

/// What the noise that is cut off at black adds to a mean signal, at most.
fn cut_off(signal: f64, noise: LinearNoise) -> f64 {
    let variance = noise.a * signal + noise.b;
    match variance > 0.0 {
        true => 0.4 * variance.sqrt() * (-0.5 * signal * signal / variance).exp(),
        false => 0.0,
    }
}
