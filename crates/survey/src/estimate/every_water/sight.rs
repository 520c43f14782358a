//! Walks from the camera to the target.

use std::f64::consts::TAU;

use uw_media::phase::PhaseTable;
use uw_render::sampling::directions::turn;

use super::super::numbers::{self, Numbers};
use super::super::target_view::TargetView;
use super::evaluate::{Paths, WaterAt};
use super::orders::{MOST, WATERS, choose_water, waters};

/// Length after which a walk is given up, in distances to the target and in metres besides.
const LONGEST: (f64, f64) = (20.0, 20.0);

/// Walks of one group that scatter and reach the target.
#[derive(Clone, Debug, Default)]
pub(super) struct SightPaths {
    paths: Paths,
    /// Per walk, how far from the point its image point sees it ends, along the texture's axes, m.
    offsets_m: Vec<[f32; 2]>,
}

/// Makes walks in one view and phase function.
pub(super) struct SightWalks<'a> {
    pub(super) view: &'a TargetView,
    pub(super) phase: &'a PhaseTable,
}

impl SightWalks<'_> {
    /// Walks whose mean over all `drawn` is the share of rays that scatter and reach the target.
    pub(super) fn walks(&self, seed: u64, group: u32, stream: u32, drawn: u32) -> SightPaths {
        let mut paths = SightPaths::default();
        for mut numbers in numbers::of_paths(seed, group, stream, drawn) {
            self.walk(&mut numbers, &mut paths);
        }
        paths
    }

    fn walk(&self, numbers: &mut Numbers, paths: &mut SightPaths) -> Option<()> {
        let (width, height) = self.view.size_px();
        let sight = (self.view).sight(numbers.next() * width, numbers.next() * height)?;
        let waters = waters();
        let scattering = waters[choose_water(numbers.next())];
        // The first flight ends before the target.
        let within = |b: f64| -(-b * sight.range_m).exp_m1();
        let first = -(-numbers.next() * within(scattering)).ln_1p() / scattering;
        let mut direction = sight.direction;
        let mut place = self.view.camera.position_m + first * direction;
        let mut length_m = first;
        for scatterings in 1..=MOST {
            let x = self.phase.sample_x(numbers.next());
            direction = turn(direction, x, numbers.next());
            let flight = numbers.length() / scattering;
            let to_target = self.view.range_m(place, direction);
            let to_target = to_target.unwrap_or(f64::INFINITY);
            if to_target <= flight {
                length_m += to_target;
                let end = place + to_target * direction;
                let density = waters
                    .map(|b| (scatterings as f64 * b.ln() - b * length_m).exp() / within(b))
                    .iter()
                    .sum::<f64>()
                    / WATERS as f64;
                paths.paths.push(scatterings, length_m, -density.ln());
                let (dx, dy) = self.view.offset(sight.point, end);
                paths.offsets_m.push([dx as f32, dy as f32]);
                return Some(());
            }
            length_m += flight;
            place += flight * direction;
            if length_m > LONGEST.0 * sight.range_m + LONGEST.1 {
                return None;
            }
        }
        None
    }
}

impl AsRef<Paths> for SightPaths {
    fn as_ref(&self) -> &Paths {
        &self.paths
    }
}

impl SightPaths {
    /// Adds to `waves`, one per frequency in cycles per metre, and returns what the walks carry.
    pub(super) fn add_waves(&self, water: WaterAt, frequencies: &[f64], waves: &mut [f64]) -> f64 {
        let mut total = 0.0;
        for ((carried, ..), [dx, dy]) in self.paths.carried(water).zip(&self.offsets_m) {
            total += carried;
            let (dx, dy) = (TAU * f64::from(*dx), TAU * f64::from(*dy));
            for (wave, f) in waves.iter_mut().zip(frequencies) {
                *wave += 0.5 * carried * ((f * dx).cos() + (f * dy).cos());
            }
        }
        total
    }
}
