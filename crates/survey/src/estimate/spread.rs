//! How the water between camera and target spreads the sight of it.

use std::f64::consts::TAU;

use uw_media::phase::PhaseTable;
use uw_render::sampling::{Draws, LEADING, directions::turn};
use uw_render::scene::Water;

use super::basis::solve;
use super::fields::GROUPS;
use super::guess::Guess;
use super::levels::{fit_levels, frequencies};
use super::pyramid::TexturePyramid;
use super::target_view::TargetView;

/// Walks per channel and group; each group is a batch of draws of its own.
const WALKS_PER_GROUP: u32 = 2048;
/// Weight below which a walk is ended or strengthened at random.
const ROULETTE_BELOW: f64 = 0.05;
/// Scatterings after which a walk is given up; only reached in water that hardly absorbs.
const MOST_SCATTERINGS: u32 = 2000;

/// What becomes of camera rays in one water and view, per channel.
#[derive(Clone, Debug)]
pub struct Spread {
    attenuation: [f64; 3],
    all: Scattered,
    groups: Vec<Scattered>,
}

/// What becomes of scattered camera rays, per channel.
#[derive(Clone, Debug)]
pub struct Scattered {
    /// Share of them that reach the target: polynomial in 1/cos - 1 of the view's angle.
    share: [[f64; 3]; 3],
    /// Weights of the pyramid's levels, sum 1.
    levels: [Vec<f32>; 3],
}

/// The numbers that a walk is made of: evenly spread ones for its first choices, then random ones.
struct Numbers {
    draws: Draws,
    used: usize,
}

impl Numbers {
    fn next(&mut self) -> f64 {
        self.used += 1;
        if self.used <= LEADING {
            self.draws.leading(self.used - 1)
        } else {
            self.draws.uniform()
        }
    }
}

impl Spread {
    /// Walks through `water` from the camera of `view` to the target. Each is weighted by the `guess` of the
    /// irradiance where it ends over that at the point its image point sees.
    pub fn new(
        water: &Water,
        phase: &PhaseTable,
        view: &TargetView,
        guess: &Guess,
        pyramid: &TexturePyramid,
        seed: u64,
    ) -> Self {
        let frequencies = frequencies(pyramid);
        let sums: [Vec<Sums>; 3] = std::array::from_fn(|k| {
            let walker = Walker {
                view,
                phase,
                guess,
                channel: k,
                absorption: water.iops.a[k],
                scattering: water.iops.b[k],
            };
            let groups = 0..GROUPS as u32;
            groups
                .map(|g| walker.walks(&frequencies, seed, g))
                .collect()
        });
        let all = sums.each_ref().map(|groups| Sums::of_all(groups));
        let scattered = |of: [&Sums; 3]| Scattered {
            share: of.map(Sums::share),
            levels: of.map(|s| fit_levels(pyramid, &frequencies, &s.transfer())),
        };
        Self {
            attenuation: water.iops.c(),
            all: scattered(all.each_ref()),
            groups: (0..GROUPS)
                .map(|g| scattered(sums.each_ref().map(|groups| &groups[g])))
                .collect(),
        }
    }

    /// No water: nothing scatters.
    pub fn none(pyramid: &TexturePyramid) -> Self {
        let mut levels = vec![0.0; pyramid.levels()];
        levels[0] = 1.0;
        let nothing = Scattered {
            share: [[0.0; 3]; 3],
            levels: [levels.clone(), levels.clone(), levels],
        };
        Self {
            attenuation: [0.0; 3],
            groups: vec![nothing.clone(); GROUPS],
            all: nothing,
        }
    }

    /// Transmittance of a ray of `range_m` per channel.
    #[inline]
    pub fn transmittance(&self, range_m: f64) -> [f64; 3] {
        self.attenuation.map(|c| (-c * range_m).exp())
    }

    /// What becomes of scattered rays, from all walks.
    pub fn scattered(&self) -> &Scattered {
        &self.all
    }

    /// The same from each group of walks alone.
    pub fn groups(&self) -> &[Scattered] {
        &self.groups
    }
}

impl Scattered {
    /// Share of scattered rays that reach the target, per channel, at the cosine of the view's angle.
    #[inline]
    pub fn share(&self, cosine: f64) -> [f64; 3] {
        let m = 1.0 / cosine - 1.0;
        self.share.map(|[a, b, c]| (a + m * (b + m * c)).max(0.0))
    }

    /// Weights of the pyramid's levels for `channel`.
    #[inline]
    pub fn levels(&self, channel: usize) -> &[f32] {
        &self.levels[channel]
    }
}

/// Walks of one channel.
struct Walker<'a> {
    view: &'a TargetView,
    phase: &'a PhaseTable,
    guess: &'a Guess,
    channel: usize,
    absorption: f64,
    scattering: f64,
}

/// Sums over all walks.
struct Sums {
    /// Moments of m = 1/cos - 1: Σ m^0 .. m^4.
    moments: [f64; 5],
    /// Σ weight · m^0 .. m^2.
    weights: [f64; 3],
    /// Σ weight · cosines of the offset, per frequency.
    waves: Vec<f64>,
}

impl Walker<'_> {
    /// The walks of one group.
    fn walks(&self, frequencies: &[f64], seed: u64, group: u32) -> Sums {
        let mut sums = Sums {
            moments: [0.0; 5],
            weights: [0.0; 3],
            waves: vec![0.0; frequencies.len()],
        };
        let (width, height) = self.view.size_px();
        let draws = Draws::new(seed, self.channel as u32, group, 0, 0x5eed);
        for walk in 0..WALKS_PER_GROUP {
            let mut numbers = Numbers {
                draws: draws.at(walk),
                used: 0,
            };
            let (x, y) = (numbers.next() * width, numbers.next() * height);
            let Some(sight) = self.view.sight(x, y) else {
                continue;
            };
            let m = 1.0 / self.view.incidence(sight.direction) - 1.0;
            let mut power = 1.0;
            for sum in &mut sums.moments {
                *sum += power;
                power *= m;
            }
            let Some((end, weight)) = self.walk(sight.direction, sight.range_m, &mut numbers)
            else {
                continue;
            };
            let k = self.channel;
            let weight = weight * self.guess.at(end)[k] / self.guess.at(sight.point)[k];
            sums.weights[0] += weight;
            sums.weights[1] += weight * m;
            sums.weights[2] += weight * m * m;
            let (dx, dy) = self.view.offset(sight.point, end);
            for (wave, f) in sums.waves.iter_mut().zip(frequencies) {
                *wave += 0.5 * weight * ((TAU * f * dx).cos() + (TAU * f * dy).cos());
            }
        }
        sums
    }

    /// A walk that scatters at least once: where it meets the target, and its weight.
    fn walk(
        &self,
        mut direction: glam::DVec3,
        range_m: f64,
        numbers: &mut Numbers,
    ) -> Option<(glam::DVec3, f64)> {
        let b = self.scattering;
        let mut weight = -(-b * range_m).exp_m1();
        if !(weight > 0.0) {
            return None;
        }
        let first = -(-numbers.next() * weight).ln_1p() / b;
        let mut origin = self.view.camera.position_m + first * direction;
        weight *= (-self.absorption * first).exp();
        for _ in 0..MOST_SCATTERINGS {
            direction = turn(
                direction,
                self.phase.sample_x(numbers.next()),
                numbers.next(),
            );
            let flight = -numbers.next().ln() / b;
            let to_target = self
                .view
                .range_m(origin, direction)
                .unwrap_or(f64::INFINITY);
            let way = flight.min(to_target);
            weight *= (-self.absorption * way).exp();
            origin += way * direction;
            if to_target <= flight {
                return Some((origin, weight));
            }
            if weight < ROULETTE_BELOW {
                if numbers.next() < 0.5 {
                    return None;
                }
                weight *= 2.0;
            }
        }
        None
    }
}

impl Sums {
    fn of_all(groups: &[Self]) -> Self {
        let total = |of: fn(&Self) -> &[f64], i: usize| groups.iter().map(|g| of(g)[i]).sum();
        Self {
            moments: std::array::from_fn(|i| total(|g| &g.moments, i)),
            weights: std::array::from_fn(|i| total(|g| &g.weights, i)),
            waves: (0..groups[0].waves.len())
                .map(|i| total(|g| &g.waves, i))
                .collect(),
        }
    }

    /// Least-squares polynomial of the weights in m; a constant where the view has no range of angles.
    fn share(&self) -> [f64; 3] {
        let s = &self.moments;
        let mut matrix = vec![s[0], s[1], s[2], s[1], s[2], s[3], s[2], s[3], s[4]];
        let mut right = self.weights.to_vec();
        match solve(&mut matrix, &mut right) {
            Some(()) if right.iter().all(|x| x.is_finite()) => [right[0], right[1], right[2]],
            _ => [self.weights[0] / s[0].max(1.0), 0.0, 0.0],
        }
    }

    /// Contrast left at each frequency by the scattered rays, relative to frequency 0.
    fn transfer(&self) -> Vec<f64> {
        let total = self.weights[0];
        self.waves
            .iter()
            .map(|w| if total > 0.0 { w / total } else { 0.0 })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use uw_media::Iops;
    use uw_media::phase::{HenyeyGreenstein, Phase};
    use uw_render::scene::{Texture, TextureFilter};

    use crate::environment::{Target, View, WaterBody, scene};
    use crate::scenery::textures::Pattern;
    use crate::vehicle::Vehicle;

    fn view_of(distance_m: f64) -> TargetView {
        let texture = Texture {
            width: 1,
            height: 1,
            texels: vec![[0.5; 3]].into(),
            filter: TextureFilter::Nearest,
        };
        let target = Target {
            pattern: Pattern::Seabed,
            texture,
        };
        let water = WaterBody {
            jerlov: "II".parse().unwrap(),
            backscatter_fraction: 0.0183,
        };
        let view = View::Target {
            depth_m: 5.0,
            distance_m,
        };
        let scene = scene(&Vehicle::default(), &water, &target, view).unwrap();
        TargetView::new(&scene).unwrap()
    }

    fn pyramid() -> TexturePyramid {
        let texels: Vec<[f32; 3]> = (0..256 * 256)
            .map(|i| [(i % 256) as f32 / 256.0; 3])
            .collect();
        let texture = Texture {
            width: 256,
            height: 256,
            texels: texels.into(),
            filter: TextureFilter::Bilinear,
        };
        TexturePyramid::new(&texture, 2.0)
    }

    /// In water that scatters almost straight on nothing is lost but what is absorbed, and little is blurred.
    #[test]
    fn forward_scattering_spreads_but_does_not_lose_light() {
        let (a, b, g, d) = ([0.1, 0.3, 0.5], [0.05; 3], 0.9999, 1.0);
        let phase = Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).unwrap());
        let water = Water {
            iops: Iops { a, b },
            phase: phase.clone(),
            refractive_index: 1.34,
        };
        let (view, pyramid) = (view_of(d), pyramid());
        let table = PhaseTable::new(&phase);
        let spread = Spread::new(&water, &table, &view, &Guess::Even, &pyramid, 3);
        for cosine in [1.0, 0.87] {
            let range = d / cosine;
            for k in 0..3 {
                let all = spread.transmittance(range)[k] + spread.scattered().share(cosine)[k];
                let expected = (-a[k] * range).exp();
                assert!(
                    (all / expected - 1.0).abs() < 2e-3,
                    "{k} {cosine}: {all} {expected}"
                );
            }
        }
        let weights = spread.scattered().levels(1);
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        // A mean cosine of 0.9999 is a mean square angle of 2e-4; the spread is a centimetre at most, so next to
        // nothing may be in levels that blur by more than ten.
        let far: f32 = (0..pyramid.levels())
            .filter(|&l| pyramid.blur_m(l) > 0.1)
            .map(|l| weights[l])
            .sum();
        assert!(far < 0.05, "{weights:?}");
        assert!(weights[0] > 0.3, "{weights:?}");
    }

    #[test]
    fn the_view_knows_where_its_rays_meet_the_target() {
        let view = view_of(2.0);
        let centre = view.sight(640.0, 360.0).unwrap();
        assert!((centre.range_m - 2.0).abs() < 1e-12);
        let corner = view.sight(0.0, 360.0).unwrap();
        // Half of 60 degrees to the side.
        assert!((corner.range_m - 2.0 / 30f64.to_radians().cos()).abs() < 1e-9);
        let (dx, dy) = view.offset(centre.point, corner.point);
        assert!((dx + 2.0 * 30f64.to_radians().tan()).abs() < 1e-9 && dy.abs() < 1e-9);
        assert!(view.range_m(DVec3::new(0.0, 0.0, -5.0), DVec3::Z).is_none());
    }
}
