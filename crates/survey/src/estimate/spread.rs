//! How the water between camera and target spreads the sight of it.

use std::f64::consts::TAU;

use uw_media::phase::PhaseTable;
use uw_render::integrator::sampling::{Rng, directions::turn};
use uw_render::scene::Water;

use super::basis::solve;
use super::guess::Guess;
use super::pyramid::TexturePyramid;
use super::target_view::TargetView;

/// Walks per channel.
const WALKS: u32 = 8192;
/// Frequencies at which the spread is compared with the pyramid's levels.
const FREQUENCIES: usize = 20;
/// Steps of the fit of the levels' weights.
const FIT_STEPS: usize = 400;
/// Weight below which a walk is ended or strengthened at random.
const ROULETTE_BELOW: f64 = 0.05;
/// Scatterings after which a walk is given up; only reached in water that hardly absorbs.
const MOST_SCATTERINGS: u32 = 2000;

/// What becomes of camera rays in one water and view, per channel.
#[derive(Clone, Debug)]
pub struct Spread {
    attenuation: [f64; 3],
    /// Share of scattered rays that reach the target: polynomial in 1/cos - 1 of the view's angle.
    share: [[f64; 3]; 3],
    /// Weights of the pyramid's levels, sum 1.
    levels: [Vec<f32>; 3],
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
        let mut share = [[0.0; 3]; 3];
        let mut levels: [Vec<f32>; 3] = Default::default();
        for k in 0..3 {
            let walker = Walker {
                view,
                phase,
                guess,
                channel: k,
                absorption: water.iops.a[k],
                scattering: water.iops.b[k],
            };
            let sums = walker.all(&frequencies, seed);
            share[k] = sums.share();
            levels[k] = fit_levels(pyramid, &frequencies, &sums.transfer());
        }
        Self {
            attenuation: water.iops.c(),
            share,
            levels,
        }
    }

    /// No water: nothing scatters.
    pub fn none(pyramid: &TexturePyramid) -> Self {
        let mut levels = vec![0.0; pyramid.levels()];
        levels[0] = 1.0;
        Self {
            attenuation: [0.0; 3],
            share: [[0.0; 3]; 3],
            levels: [levels.clone(), levels.clone(), levels],
        }
    }

    /// Transmittance of a ray of `range_m` per channel.
    #[inline]
    pub fn transmittance(&self, range_m: f64) -> [f64; 3] {
        self.attenuation.map(|c| (-c * range_m).exp())
    }

    /// Share of scattered rays that reach the target, per channel, at the cosine of the view's angle.
    #[inline]
    pub fn scattered_share(&self, cosine: f64) -> [f64; 3] {
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
    fn all(&self, frequencies: &[f64], seed: u64) -> Sums {
        let mut sums = Sums {
            moments: [0.0; 5],
            weights: [0.0; 3],
            waves: vec![0.0; frequencies.len()],
        };
        let (width, height) = self.view.size_px();
        for walk in 0..WALKS {
            let mut rng = Rng::new(seed, walk, self.channel as u32, 0x5eed);
            let (x, y) = (rng.uniform() * width, rng.uniform() * height);
            let Some(sight) = self.view.sight(x, y) else {
                continue;
            };
            let m = 1.0 / self.view.incidence(sight.direction) - 1.0;
            let mut power = 1.0;
            for sum in &mut sums.moments {
                *sum += power;
                power *= m;
            }
            let Some((end, weight)) = self.walk(sight.direction, sight.range_m, &mut rng) else {
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
        rng: &mut Rng,
    ) -> Option<(glam::DVec3, f64)> {
        let b = self.scattering;
        let mut weight = -(-b * range_m).exp_m1();
        if !(weight > 0.0) {
            return None;
        }
        let first = -(-rng.uniform() * weight).ln_1p() / b;
        let mut origin = self.view.camera.position_m + first * direction;
        weight *= (-self.absorption * first).exp();
        for _ in 0..MOST_SCATTERINGS {
            direction = turn(direction, self.phase.sample_x(rng.uniform()), rng.uniform());
            let flight = -rng.uniform().ln() / b;
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
                if rng.uniform() < 0.5 {
                    return None;
                }
                weight *= 2.0;
            }
        }
        None
    }
}

impl Sums {
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

/// Frequencies, cycles per metre, from far below the tile's to the finest the texture holds.
fn frequencies(pyramid: &TexturePyramid) -> Vec<f64> {
    let finest = 0.5 / pyramid.texel_m();
    let coarsest = finest / 2f64.powi(pyramid.levels() as i32);
    let step = (finest / coarsest).powf(1.0 / (FREQUENCIES - 1) as f64);
    (0..FREQUENCIES)
        .map(|i| coarsest * step.powi(i as i32))
        .collect()
}

/// Weights >= 0 with sum 1 of the levels, whose blurs together come closest to `transfer` (least squares by
/// coordinate descent).
fn fit_levels(pyramid: &TexturePyramid, frequencies: &[f64], transfer: &[f64]) -> Vec<f32> {
    let n = pyramid.levels();
    // The mean's weight makes up the sum; its own transfer is 0.
    let columns: Vec<Vec<f64>> = (0..n - 1)
        .map(|level| {
            let blur = pyramid.blur_m(level);
            frequencies
                .iter()
                .map(|f| (-0.5 * (TAU * f * blur).powi(2)).exp())
                .collect()
        })
        .collect();
    let mut weights = vec![0.0; n - 1];
    let mut residual = transfer.to_vec();
    for _ in 0..FIT_STEPS {
        for (level, column) in columns.iter().enumerate() {
            let square: f64 = column.iter().map(|c| c * c).sum();
            let along: f64 = column.iter().zip(&residual).map(|(c, r)| c * r).sum();
            let others: f64 = weights.iter().sum::<f64>() - weights[level];
            let new = (weights[level] + along / square).clamp(0.0, (1.0 - others).max(0.0));
            let change = new - weights[level];
            weights[level] = new;
            residual
                .iter_mut()
                .zip(column)
                .for_each(|(r, c)| *r -= change * c);
        }
    }
    let rest = (1.0 - weights.iter().sum::<f64>()).max(0.0);
    weights.push(rest);
    weights.into_iter().map(|w| w as f32).collect()
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
                let all = spread.transmittance(range)[k] + spread.scattered_share(cosine)[k];
                let expected = (-a[k] * range).exp();
                assert!(
                    (all / expected - 1.0).abs() < 2e-3,
                    "{k} {cosine}: {all} {expected}"
                );
            }
        }
        let weights = spread.levels(1);
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
