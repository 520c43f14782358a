//! Sums of what rays through a pixel see, surface by surface.

use super::guides::{Fragment, Sampled, Shown};
use super::look::{Look, Seen, StraightLight};

/// What rays through a pixel have seen of its surfaces.
#[derive(Default)]
pub(super) struct Gathered {
    found: Vec<Found>,
}

/// What they have seen of one.
#[derive(Default)]
pub(super) struct Found {
    region: u32,
    normal: [f64; 3],
    shown: [Sums; 2],
    lights: [Lights; 2],
    /// Straight light of lamps and day together.
    light: Range,
    pub(super) walked: [Sums; 2],
    pub(super) lit: [Sums; 2],
    reflectance: Range,
}

/// Sums over rays.
#[derive(Clone, Copy, Default)]
pub(super) struct Sums {
    count: f64,
    transmittance: [f64; 3],
    seen: [f64; 3],
}

impl Sums {
    pub(super) fn add(&mut self, seen: &Seen) {
        self.count += 1.0;
        for k in 0..3 {
            self.transmittance[k] += seen.transmittance[k];
            self.seen[k] += seen.reflectance[k] * seen.transmittance[k];
        }
    }

    fn mean(&self, sum: [f64; 3]) -> [f32; 3] {
        sum.map(|sum| (sum / self.count.max(1.0)) as f32)
    }
}

/// Sums of straight light over rays.
#[derive(Clone, Copy, Default)]
struct Lights {
    count: f64,
    lamps: [f64; 3],
    day: [f64; 3],
}

/// Sums over all rays of both halves.
#[derive(Clone, Copy, Default)]
struct Range {
    count: f64,
    first: [f64; 3],
    sum: [f64; 3],
    squares: [f64; 3],
}

impl Range {
    fn add(&mut self, values: [f64; 3]) {
        if self.count == 0.0 {
            self.first = values;
        }
        self.count += 1.0;
        for k in 0..3 {
            // About the first value, so that equal values deviate by nothing.
            let value = values[k] - self.first[k];
            self.sum[k] += value;
            self.squares[k] += value * value;
        }
    }

    /// Standard deviation over the mean, of the channel where that is largest.
    fn deviation(&self) -> f64 {
        let n = self.count.max(1.0);
        let of = |k: usize| {
            let mean = self.sum[k] / n;
            let variance = (self.squares[k] / n - mean * mean).max(0.0);
            let level = self.first[k] + mean;
            if variance > 0.0 {
                variance.sqrt() / level
            } else {
                0.0
            }
        };
        (0..3).map(of).fold(0.0, f64::max)
    }
}

impl Gathered {
    /// What is gathered of a region.
    pub(super) fn of_region(&mut self, region: u32) -> &mut Found {
        let index = match self.found.iter().position(|found| found.region == region) {
            Some(index) => index,
            None => {
                self.found.push(Found {
                    region,
                    ..Found::default()
                });
                self.found.len() - 1
            }
        };
        &mut self.found[index]
    }

    /// Largest relative deviation of reflectance; infinite where there is more than one surface.
    pub(super) fn deviation(&self) -> f64 {
        match &self.found[..] {
            [only] => only.reflectance.deviation(),
            _ => f64::INFINITY,
        }
    }

    /// Whether there is more than one surface.
    pub(super) fn has_edge(&self) -> bool {
        self.found.len() > 1
    }

    /// Largest relative deviation of the light of a surface.
    pub(super) fn light_deviation(&self) -> f64 {
        let deviations = self.found.iter().map(|found| found.light.deviation());
        deviations.fold(0.0, f64::max)
    }

    /// The fragments.
    pub(super) fn fragments(&self) -> Vec<Fragment> {
        let sum = |of: &dyn Fn(&Found) -> f64| self.found.iter().map(of).sum::<f64>();
        let shown = [0, 1].map(|half| sum(&|found| found.shown[half].count));
        let walked = [0, 1].map(|half| sum(&|found| found.walked[half].count));
        let lit = [0, 1].map(|half| sum(&|found| found.lit[half].count));
        let of = |found: &Found| {
            let rays = (found.shown[0].count + found.shown[1].count).max(1.0);
            let shown = [0, 1].map(|half| found.shown(half, shown[half]));
            let sampled = |sums: &[Sums; 2], of_all: [f64; 2]| {
                [0, 1].map(|half| match of_all[half] > 0.0 {
                    true => Sampled {
                        share: (sums[half].count / of_all[half]) as f32,
                        seen: sums[half].mean(sums[half].seen),
                    },
                    // They were not followed.
                    false => shown[half].sampled(),
                })
            };
            Fragment {
                region: found.region,
                normal: found.normal.map(|sum| (sum / rays) as f32),
                shown,
                walked: sampled(&found.walked, walked),
                lit: sampled(&found.lit, lit),
            }
        };
        self.found.iter().map(of).collect()
    }
}

impl Found {
    /// Adds a ray to what is known for a half.
    pub(super) fn show(&mut self, half: usize, seen: &Seen) {
        self.shown[half].add(seen);
        self.reflectance.add(seen.reflectance);
        let normal = seen.shading_normal.to_array();
        (0..3).for_each(|k| self.normal[k] += normal[k]);
    }

    /// Whether nothing is known of its light for a half.
    pub(super) fn is_dark(&self, half: usize) -> bool {
        self.lights[half].count == 0.0
    }

    /// Adds the straight light at the end of a ray, over the reflectance that it is proportional to.
    pub(super) fn light(&mut self, half: usize, look: &Look, light: &StraightLight) {
        let over = |light: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|k| {
                let seen = look.reflectance[k] * look.transmittance[k];
                if seen > 0.0 { light[k] / seen } else { 0.0 }
            })
        };
        let (lamps, day) = (over(light.lamps), over(light.day));
        let sums = &mut self.lights[half];
        sums.count += 1.0;
        for k in 0..3 {
            sums.lamps[k] += lamps[k];
            sums.day[k] += day[k];
        }
        self.light.add([0, 1, 2].map(|k| lamps[k] + day[k]));
    }

    /// What is known for a half, of whose rays there are `rays`; a surface that none of them has met is as the other half's.
    fn shown(&self, half: usize, rays: f64) -> Shown {
        let known = match self.shown[half].count > 0.0 {
            true => half,
            false => 1 - half,
        };
        let (sums, lights) = (&self.shown[known], &self.lights[known]);
        let light = |sum: [f64; 3]| sum.map(|sum| (sum / lights.count.max(1.0)) as f32);
        Shown {
            share: (self.shown[half].count / rays.max(1.0)) as f32,
            seen: sums.mean(sums.seen),
            transmittance: sums.mean(sums.transmittance),
            lamps: light(lights.lamps),
            day: light(lights.day),
        }
    }
}
