//! The field of all channels over one grid of depths, so that one look gives all of them.

use super::{AZIMUTHS, COSINES, DEPTHS, column::Column, solver::Solution, worth::Worths};
use uw_media::Spectrum;

/// Ratio of attenuation coefficients up to which channels share the grid's reach: beyond the grid a channel's light
/// decays as it does asymptotically.
const LARGEST_RATIO: f64 = 30.0;
/// Optical depth below the deepest point of interest down to which the grid goes, in the clearest channel.
const BELOW: f64 = 8.0;

/// Values per channel and padding, which makes a row one vector.
pub(crate) type Entry = [f32; 4];

/// Logarithms of radiances (so that steep decays are interpolated well) and irradiances, and what directions are worth.
#[derive(Clone, Debug)]
pub(crate) struct FieldTable {
    pub(crate) max_depth_m: f64,
    /// −d ln L/dz beyond the grid, 1/m.
    pub(crate) decay_per_m: Entry,
    /// Nodes in azimuth, 1 where nothing depends on it.
    azimuths: usize,
    ln_scattered: Vec<Entry>,
    ln_down: Vec<Entry>,
    ln_up: Vec<Entry>,
    worth: Vec<Entry>,
}

/// One channel before it goes into the table.
pub(super) struct ChannelField<'a> {
    pub(super) column: Column<'a>,
    pub(super) solution: Solution,
    pub(super) worths: Worths,
}

impl FieldTable {
    /// A table down to `deepest_m` and below; `scatters` tells which channels do, in at least one; `strategies` gives
    /// the channel of each strategy in use, whose mean share counts; `turns` whether the light depends on azimuth.
    pub(super) fn new(
        channels: &[ChannelField<'_>; 3],
        scatters: [bool; 3],
        strategies: &[usize],
        turns: bool,
        deepest_m: f64,
    ) -> Self {
        let relevant = || {
            (0..3)
                .filter(|&k| scatters[k])
                .map(|k| channels[k].column.lowest_c())
        };
        let c_max = relevant().fold(0.0, f64::max);
        let c_min = relevant().fold(f64::INFINITY, f64::min);
        let max_depth_m = deepest_m + BELOW / c_min.max(c_max / LARGEST_RATIO);
        let azimuths = if turns { AZIMUTHS } else { 1 };
        let columns: Vec<usize> = (0..COSINES * azimuths)
            .map(|i| i / azimuths * AZIMUTHS + i % azimuths)
            .collect();
        let directions = COSINES * AZIMUTHS;
        let grid = Depths {
            channels,
            max_depth_m,
        };
        let ln = |values: &[f64]| -> Vec<f32> {
            values.iter().map(|v| v.max(1e-300).ln() as f32).collect()
        };
        let per_channel = |values: &dyn Fn(&Solution) -> Vec<f32>| {
            [0, 1, 2].map(|k| values(&channels[k].solution))
        };
        let decay = [0, 1, 2].map(|k| channels[k].solution.decay);
        let scattered = per_channel(&|s| ln(&s.scattered));
        let (down, up) = (per_channel(&|s| ln(&s.down)), per_channel(&|s| ln(&s.up)));
        let mut table = Self {
            max_depth_m,
            decay_per_m: [0.0; 4],
            azimuths,
            ln_scattered: grid.resample(&scattered, decay, directions, &columns),
            ln_down: grid.resample(&down, decay, 1, &[0]),
            ln_up: grid.resample(&up, decay, 1, &[0]),
            worth: grid.worth(scatters, strategies, directions, &columns),
        };
        for k in 0..3 {
            table.decay_per_m[k] =
                (channels[k].solution.decay * channels[k].column.lowest_c()) as f32;
        }
        table
    }

    /// Nodes in azimuth, and the tables as they lie: logarithms of radiances ([depth][cosine][azimuth]), of downward and of
    /// upward irradiances ([depth]), and what directions are worth, the same to all channels (like radiances): share around the sun,
    /// light, sunlight over the phase function.
    pub(crate) fn parts(&self) -> (usize, [&[Entry]; 4]) {
        let tables = [&self.ln_scattered, &self.ln_down, &self.ln_up, &self.worth];
        (self.azimuths, tables.map(Vec::as_slice))
    }
}

/// The table's depths and what is brought onto them.
struct Depths<'a> {
    channels: &'a [ChannelField<'a>; 3],
    max_depth_m: f64,
}

impl Depths<'_> {
    /// Columns of the channels' tables of `row` columns, at the depths of the grid.
    fn resample(
        &self,
        values: &[Vec<f32>; 3],
        decay: Spectrum,
        row: usize,
        columns: &[usize],
    ) -> Vec<Entry> {
        let mut entries = Vec::with_capacity(DEPTHS * columns.len());
        for node in 0..DEPTHS {
            let depth_m = self.max_depth_m * square(node);
            let depths = [0, 1, 2].map(|k| self.channels[k].column.optical_depth(depth_m));
            entries.extend(columns.iter().map(|&column| {
                let at =
                    |k: usize| self.channels[k].at(&values[k], depths[k], row, column, decay[k]);
                [at(0), at(1), at(2), 0.0]
            }));
        }
        entries
    }

    /// What directions are worth at the depths of the grid: shares are means over strategies; of light it is that of the channel with most
    /// of it, over what each has.
    fn worth(
        &self,
        scatters: [bool; 3],
        strategies: &[usize],
        row: usize,
        columns: &[usize],
    ) -> Vec<Entry> {
        let of = |values: &dyn Fn(&Worths) -> Vec<f32>| {
            let values = [0, 1, 2].map(|k| values(&self.channels[k].worths));
            self.resample(&values, [0.0; 3], row, columns)
        };
        let [shares, light, sunlight] = [
            of(&|own| own.sun_share.clone()),
            of(&|own| own.light.clone()),
            of(&|own| own.sunlight.clone()),
        ];
        let most = |entry: &Entry| {
            let of_scattering = (0..3).filter(|&k| scatters[k]).map(|k| entry[k]);
            of_scattering.fold(0.0, f32::max)
        };
        let entry = |i: usize| {
            let share = strategies.iter().map(|&k| shares[i][k]).sum::<f32>();
            [
                share / strategies.len() as f32,
                most(&light[i]),
                most(&sunlight[i]),
                0.0,
            ]
        };
        (0..shares.len()).map(entry).collect()
    }
}

impl ChannelField<'_> {
    /// The value at an optical depth of a table over the solution's own depths with `row` columns, beyond which it falls by
    /// `decay` per optical depth.
    fn at(&self, values: &[f32], depth: f64, row: usize, column: usize, decay: f64) -> f32 {
        let steps = (depth / self.solution.max_depth).sqrt().min(1.0) * (DEPTHS - 1) as f64;
        let node = (steps as usize).min(DEPTHS - 2);
        let (upper, lower) = (
            values[node * row + column],
            values[(node + 1) * row + column],
        );
        let value = upper + (steps - node as f64) as f32 * (lower - upper);
        let beyond = (depth - self.solution.max_depth).max(0.0) * decay;
        value - beyond as f32
    }
}

/// Depth of a node, of the deepest one's.
fn square(node: usize) -> f64 {
    (node as f64 / (DEPTHS - 1) as f64).powi(2)
}
