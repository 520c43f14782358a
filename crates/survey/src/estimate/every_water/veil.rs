//! Paths from the camera to a lamp that never meet the target.

use glam::DVec3;
use uw_media::phase::PhaseTable;
use uw_render::prepare::PreparedLamp;
use uw_render::sampling::directions::{sin2_half, turn};

use super::super::numbers::{self, Numbers};
use super::super::target_view::{Sight, TargetView};
use super::bridge::Bridges;
use super::evaluate::Paths;
use super::orders::{MOST, Orders, WATERS, choose_water, waters};

/// Of the lengths of a path's camera part: share whose density follows the lamp's light along the pixel's ray, and share
/// of an exponential distribution that is the same in all waters; the rest goes by the water of the mixture.
const SHARES: (f64, f64) = (0.5, 0.1);
/// How far along the ray the first go, relative to its length.
const REACH: f64 = 1.2;
/// Rates, over 1/range, of the exponential distributions: of the second, and of the rest in water that does not scatter.
const RATES: (f64, f64) = (0.25, 1.0);

/// Veil by one lamp of unit intensity on its axis.
///
/// A path is a walk from the camera, a joint, and a bridge from there to the lamp. Any of its scatterings could be the
/// joint; the one with the largest deflection is, so that each path is met in one way only and the phase function at the
/// joint stays small.
pub(super) struct Veil<'a> {
    pub(super) view: &'a TargetView,
    pub(super) lamp: &'a PreparedLamp,
    pub(super) phase: &'a PhaseTable,
    pub(super) orders: &'a Orders,
}

/// Where a walk from the camera ends.
struct Walk {
    end: DVec3,
    direction: DVec3,
    /// sin²(θ/2) of its largest deflection.
    largest: f64,
}

impl Veil<'_> {
    /// Paths whose mean over all `drawn` is the veil's over the image.
    pub(super) fn paths(&self, seed: u64, group: u32, stream: u32, drawn: u32) -> Paths {
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
        let lengths = Lengths::new(&sight, self.view.camera.position_m, self.lamp.position);
        let water = choose_water(numbers.next());
        let length_m = lengths.draw(water, numbers.next());
        let before = self.orders.draw(water, length_m, numbers.next())?;
        let after_number = numbers.next();
        let walk = self.walk(&sight, length_m, before, numbers)?;
        let distance_m = (self.lamp.position - walk.end).length();
        let after = self.orders.draw(water, distance_m, after_number)?;
        if before + after + 1 > MOST {
            return None;
        }
        let bridge = bridges.bridge((walk.end, self.lamp.position), after, numbers)?;
        let deflection = sin2_half(walk.direction, bridge.start);
        if deflection < walk.largest.max(bridge.largest) {
            return None;
        }
        let carried = self.phase.value(deflection) * self.lamp.relative_intensity(-bridge.end);
        if !(carried > 0.0) {
            return None;
        }
        let density = (0..WATERS)
            .map(|i| {
                lengths.density(i, length_m)
                    * self.orders.probability(i, length_m, before)
                    * self.orders.probability(i, distance_m, after)
            })
            .sum::<f64>()
            / WATERS as f64;
        let log_weight = (carried / density).ln() + before as f64 * length_m.ln()
            - self.orders.log_factorial(before)
            + (after + 1) as f64 * bridge.length_m.ln()
            - self.orders.log_factorial(after)
            - 3.0 * bridge.distance_m.ln();
        paths.push(before + 1 + after, length_m + bridge.length_m, log_weight);
        Some(())
    }

    /// A walk of `length_m` with `scatterings` at even places on it; `None` where it meets the target.
    fn walk(
        &self,
        sight: &Sight,
        length_m: f64,
        scatterings: usize,
        numbers: &mut Numbers,
    ) -> Option<Walk> {
        let flights: Vec<f64> = if scatterings == 0 {
            vec![1.0]
        } else {
            (0..=scatterings).map(|_| numbers.length()).collect()
        };
        let scale = length_m / flights.iter().sum::<f64>();
        let mut walk = Walk {
            end: self.view.camera.position_m,
            direction: sight.direction,
            largest: 0.0,
        };
        for (i, flight) in flights.iter().enumerate() {
            if i > 0 {
                let x = self.phase.sample_x(numbers.next());
                walk.largest = walk.largest.max(x);
                walk.direction = turn(walk.direction, x, numbers.next());
            }
            walk.end += scale * flight * walk.direction;
            self.view.range_m(walk.end, -self.view.normal)?;
        }
        Some(walk)
    }
}

/// Distributions of the length of walks along one ray.
struct Lengths {
    /// Where along the ray the lamp is nearest, m, and how near.
    nearest_m: f64,
    off_m: f64,
    /// Angles at the lamp from the nearest point to the ray's start and to the farthest point.
    angles: (f64, f64),
    reach_m: f64,
    slow: f64,
    rates: [f64; WATERS],
}

impl Lengths {
    fn new(sight: &Sight, eye: DVec3, lamp: DVec3) -> Self {
        let to_lamp = lamp - eye;
        let nearest_m = to_lamp.dot(sight.direction);
        // A lamp on the ray itself would have all lengths at it.
        let off_m = (to_lamp - nearest_m * sight.direction)
            .length()
            .max(0.01 * sight.range_m);
        let reach_m = REACH * sight.range_m;
        Self {
            nearest_m,
            off_m,
            angles: (
                (-nearest_m / off_m).atan(),
                ((reach_m - nearest_m) / off_m).atan(),
            ),
            reach_m,
            slow: RATES.0 / sight.range_m,
            rates: waters().map(|b| RATES.1 / sight.range_m + b),
        }
    }

    fn draw(&self, water: usize, u: f64) -> f64 {
        let (by_lamp, slow) = SHARES;
        if u < by_lamp {
            let (from, to) = self.angles;
            let angle = from + u / by_lamp * (to - from);
            return (self.nearest_m + self.off_m * angle.tan()).max(1e-9 * self.reach_m);
        }
        let u = (u - by_lamp) / (1.0 - by_lamp);
        let slow_share = slow / (1.0 - by_lamp);
        if u < slow_share {
            -(u / slow_share).ln() / self.slow
        } else {
            -((u - slow_share) / (1.0 - slow_share)).ln() / self.rates[water]
        }
    }

    /// Density of `length_m`, 1/m.
    fn density(&self, water: usize, length_m: f64) -> f64 {
        let (by_lamp, slow) = SHARES;
        let exponential = |rate: f64| rate * (-rate * length_m).exp();
        let rest =
            slow * exponential(self.slow) + (1.0 - by_lamp - slow) * exponential(self.rates[water]);
        if length_m > self.reach_m {
            return rest;
        }
        let along = length_m - self.nearest_m;
        let wide = self.angles.1 - self.angles.0;
        rest + by_lamp * self.off_m / (wide * (self.off_m * self.off_m + along * along))
    }
}
