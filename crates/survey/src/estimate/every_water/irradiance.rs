//! Paths from a lamp to the points of the target that an image sees.

use std::f64::consts::PI;

use uw_media::phase::PhaseTable;
use uw_render::prepare::PreparedLamp;

use super::super::numbers::{self, Numbers};
use super::super::target_view::TargetView;
use super::bridge::Bridges;
use super::evaluate::Paths;
use super::orders::{Orders, WATERS, choose_water};

/// Columns and rows of the image points for which unscattered light is taken.
const POINTS: (usize, usize) = (48, 27);

/// Irradiance over π by one lamp of unit intensity on its axis.
pub(super) struct Irradiance<'a> {
    pub(super) view: &'a TargetView,
    pub(super) lamp: &'a PreparedLamp,
    pub(super) phase: &'a PhaseTable,
    pub(super) orders: &'a Orders,
}

impl Irradiance<'_> {
    /// Paths that scatter; their mean over all `drawn` is the quantity's over the image.
    pub(super) fn scattered(&self, seed: u64, group: u32, stream: u32, drawn: u32) -> Paths {
        let mut paths = Paths::default();
        let mut bridges = Bridges::new(self.view, self.phase);
        for mut numbers in numbers::of_paths(seed, group, stream, drawn) {
            self.path(&mut bridges, &mut numbers, &mut paths);
        }
        paths
    }

    fn path(&self, bridges: &mut Bridges, numbers: &mut Numbers, paths: &mut Paths) -> Option<()> {
        let (width, height) = self.view.size_px();
        let sight = (self.view).sight(numbers.next() * width, numbers.next() * height)?;
        let water = choose_water(numbers.next());
        let distance_m = (sight.point - self.lamp.position).length();
        // One scattering is certain; the mixture says how many there are besides.
        let more = self.orders.draw(water, distance_m, numbers.next())?;
        let order = more + 1;
        let bridge = bridges.bridge((self.lamp.position, sight.point), order, numbers)?;
        let cosine = self.view.incidence(bridge.end).max(0.0);
        let emitted = self.lamp.relative_intensity(bridge.start);
        if !(cosine * emitted > 0.0) {
            return None;
        }
        let probability = (0..WATERS)
            .map(|i| self.orders.probability(i, distance_m, more))
            .sum::<f64>()
            / WATERS as f64;
        let log_weight = (cosine * emitted / (PI * probability)).ln()
            + (order + 1) as f64 * bridge.length_m.ln()
            - self.log_factorial(order)
            - 3.0 * distance_m.ln();
        paths.push(order, bridge.length_m, log_weight);
        Some(())
    }

    fn log_factorial(&self, order: usize) -> f64 {
        self.orders.log_factorial(order - 1) + (order as f64).ln()
    }

    /// Light that comes straight, at points evenly over the image; their sum is the quantity's mean.
    pub(super) fn straight(&self) -> Paths {
        let mut paths = Paths::default();
        let (width, height) = self.view.size_px();
        let (columns, rows) = POINTS;
        let share = 1.0 / (columns * rows) as f64;
        for i in 0..columns * rows {
            let x = ((i % columns) as f64 + 0.5) / columns as f64 * width;
            let y = ((i / columns) as f64 + 0.5) / rows as f64 * height;
            let Some(sight) = self.view.sight(x, y) else {
                continue;
            };
            let way = sight.point - self.lamp.position;
            let distance_m = way.length();
            let direction = way / distance_m;
            let cosine = self.view.incidence(direction).max(0.0);
            let carried = share * cosine * self.lamp.relative_intensity(direction)
                / (PI * distance_m * distance_m);
            if carried > 0.0 {
                paths.push(0, distance_m, carried.ln());
            }
        }
        paths
    }
}
