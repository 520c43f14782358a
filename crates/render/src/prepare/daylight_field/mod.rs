//! What daylight is like far from any object: a plane-parallel estimate that tells walks where light is.
//!
//! Made at start-up from a coarse solution of the transfer equation per channel ([`solver`]). It steers how
//! many copies of a walk go on; whatever its errors, they cannot bias a picture.

mod solver;
mod transition;

use glam::DVec3;
use rayon::prelude::*;

use super::{Boundary, Medium, SunBeam};
use solver::{Daylight, Solution};
use transition::Transitions;

/// Bins in the cosine u of the viewing direction against the vertical.
const COSINES: usize = 40;
/// Nodes in depth, spaced as squares.
const DEPTHS: usize = 97;
/// Azimuthal Fourier modes.
const MODES: usize = 10;
/// Nodes in azimuth, at φ = 2 asin(p/8) from the sun.
const AZIMUTHS: usize = 9;
/// Optical depth below the deepest point of interest down to which the equation is solved.
const BELOW: f64 = 8.0;
/// sin²(θ/2) of the cone (5.7°) whose scattering counts as blurred transmission of the sunlight.
const NARROW_X: f64 = 0.0025;
/// Single scattering albedo below which flights are stretched towards the surface.
const STRETCH_BELOW: f64 = 0.8;
/// Share of the asymptotic decay by which they are.
const STRETCH_SHARE: f64 = 0.8;
/// |ln| of the ratio of a channel's attenuation to a strategy's coefficient within which it follows it.
const STRETCH_MATCH: f64 = 0.3;
/// Largest exponent of that correction.
const MAX_NARROW: f64 = 30.0;

/// Plane-parallel daylight in homogeneous water: radiance per direction and depth, irradiances.
#[derive(Clone, Debug)]
pub struct DaylightField {
    pub(crate) channels: [Channel; 3],
    pub(crate) sun_azimuth: Option<(f64, f64)>,
}

/// One channel; logarithms of radiances, so that steep decays are interpolated well.
#[derive(Clone, Debug)]
pub(crate) struct Channel {
    pub(crate) c: f64,
    pub(crate) max_depth: f64,
    pub(crate) decay: f64,
    pub(crate) narrow_rate: f64,
    pub(crate) ln_scattered: Vec<f32>,
    pub(crate) ln_down: Vec<f32>,
    pub(crate) ln_up: Vec<f32>,
}

impl DaylightField {
    /// The daylight down to `deepest_m` (m below the surface) and beyond; `None` where it cannot be or where
    /// nothing scatters.
    pub fn build(
        medium: &Medium,
        boundary: &Boundary,
        sun: Option<&SunBeam>,
        sky: [f64; 3],
        deepest_m: f64,
    ) -> Option<Self> {
        if !medium.scatters() || (sun.is_none() && sky == [0.0; 3]) {
            return None;
        }
        let transitions = Transitions::build(&medium.phase);
        let channels: Vec<Channel> = (0..3)
            .into_par_iter()
            .map(|k| {
                let c = medium.c[k];
                let albedo = if c > 0.0 { medium.b[k] / c } else { 0.0 };
                let light = Daylight {
                    albedo,
                    sun: sun.map(|s| (s.towards.z, s.irradiance[k])),
                    sky: sky[k],
                    boundary: *boundary,
                };
                let solution = Solution::solve(&light, &transitions, c * deepest_m + BELOW);
                let narrow_rate =
                    sun.map_or(0.0, |s| transitions.narrow * albedo * c / s.towards.z);
                Channel::new(c, narrow_rate, &solution)
            })
            .collect();
        let horizontal = |s: &SunBeam| {
            let length = s.towards.truncate().length();
            (length > 1e-2).then(|| (s.towards.x / length, s.towards.y / length))
        };
        Some(Self {
            channels: channels.try_into().ok()?,
            sun_azimuth: sun.and_then(horizontal),
        })
    }

    /// Radiance seen at `depth_m` in unit direction `view` that scattered more than once, or that came from
    /// the sky and scattered at least once; W/(m² sr) per channel. `line` is the radiance of singly scattered
    /// sunlight in that direction: what is narrowly scattered besides is a multiple of it.
    pub fn scattered(&self, depth_m: f64, view: DVec3, line: [f64; 3]) -> [f64; 3] {
        let (low, weight) = cosine_bin(view.z);
        let (azimuth, azimuth_weight) = self.azimuth_bin(view);
        std::array::from_fn(|k| {
            let channel = &self.channels[k];
            let (node, fraction, beyond) = channel.depth_node(depth_m);
            let at = |node: usize, bin: usize| {
                let i = (node * COSINES + bin) * AZIMUTHS + azimuth;
                let t = &channel.ln_scattered;
                mix(t[i], t[(i + 1).min(t.len() - 1)], azimuth_weight)
            };
            let upper = mix(at(node, low), at(node, low + 1), weight);
            let lower = mix(at(node + 1, low), at(node + 1, low + 1), weight);
            let broad = f64::from(mix(upper, lower, fraction) - beyond).exp();
            if view.z <= 0.0 || line[k] == 0.0 {
                return broad;
            }
            let narrow = (channel.narrow_rate * depth_m).min(MAX_NARROW);
            broad.max(line[k] * narrow.exp_m1())
        })
    }

    /// Downward and upward plane irradiance at `depth_m`, W/m² per channel, without the sun's own beam.
    pub fn diffuse_irradiance(&self, depth_m: f64) -> [(f64, f64); 3] {
        std::array::from_fn(|k| {
            let channel = &self.channels[k];
            let (node, fraction, beyond) = channel.depth_node(depth_m);
            let at = |t: &[f32]| f64::from(mix(t[node], t[node + 1], fraction) - beyond).exp();
            (at(&channel.ln_down), at(&channel.ln_up))
        })
    }

    /// How much longer flights upwards should be than downwards: σ(1 − κu) with κ per strategy of `medium`.
    /// Only where absorption makes the light come from above; else 0.
    pub fn stretch(&self, medium: &Medium) -> [f64; 3] {
        let strategies = &medium.by_attenuation;
        std::array::from_fn(|j| {
            (0..3)
                .filter(|&k| {
                    medium.b[k] > 0.0
                        && (medium.c[k] / strategies.sigma[j]).ln().abs() < STRETCH_MATCH
                })
                .map(|k| {
                    if medium.b[k] < STRETCH_BELOW * medium.c[k] {
                        STRETCH_SHARE * self.channels[k].decay
                    } else {
                        0.0
                    }
                })
                .reduce(f64::min)
                .unwrap_or(0.0)
        })
    }

    fn azimuth_bin(&self, view: DVec3) -> (usize, f32) {
        let Some((x, y)) = self.sun_azimuth else {
            return (0, 0.0);
        };
        let across = (view.x * view.x + view.y * view.y).sqrt().max(1e-30);
        let cosine = (view.x * x + view.y * y) / across;
        let place = (0.5 * (1.0 - cosine)).clamp(0.0, 1.0).sqrt() * (AZIMUTHS - 1) as f64;
        let low = (place as usize).min(AZIMUTHS - 2);
        (low, (place - low as f64) as f32)
    }
}

impl Channel {
    fn new(c: f64, narrow_rate: f64, solution: &Solution) -> Self {
        let ln = |values: &[f64]| values.iter().map(|v| v.max(1e-300).ln() as f32).collect();
        Self {
            c,
            max_depth: solution.max_depth,
            decay: solution.decay,
            narrow_rate,
            ln_scattered: ln(&solution.scattered),
            ln_down: ln(&solution.down),
            ln_up: ln(&solution.up),
        }
    }

    /// Node above the depth, fraction of the way to the next one, and −ln of the decay beyond the last.
    fn depth_node(&self, depth_m: f64) -> (usize, f32, f32) {
        let depth = self.c * depth_m.max(0.0);
        if depth >= self.max_depth {
            let beyond = self.decay * (depth - self.max_depth);
            return (DEPTHS - 2, 1.0, beyond as f32);
        }
        let place = (depth / self.max_depth).sqrt() * (DEPTHS - 1) as f64;
        let node = (place as usize).min(DEPTHS - 2);
        (node, (place - node as f64) as f32, 0.0)
    }
}

/// Bin below the cosine and the weight of the bin above it.
fn cosine_bin(u: f64) -> (usize, f32) {
    let place = (0.5 * (u + 1.0) * COSINES as f64 - 0.5).clamp(0.0, (COSINES - 1) as f64);
    let low = (place as usize).min(COSINES - 2);
    (low, (place - low as f64) as f32)
}

#[inline]
fn mix(a: f32, b: f32, weight: f32) -> f32 {
    a + weight * (b - a)
}

/// Centre of a cosine bin.
fn bin_cosine(bin: usize) -> f64 {
    -1.0 + (bin as f64 + 0.5) * 2.0 / COSINES as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Water;
    use uw_media::{
        Iops,
        phase::{Phase, Rayleigh},
    };

    /// Mobley et al. 1993, problem 1 (albedo 0.9): E_d and E_u from discrete ordinates, for a sun at 60° with
    /// 0.5 W/m² on the horizontal. A field that only steers may be off by some percent, not by a factor.
    #[test]
    fn irradiances_are_nearly_those_of_discrete_ordinates() {
        let medium = Medium::build(&Water {
            iops: Iops {
                a: [0.1; 3],
                b: [0.9; 3],
            },
            phase: Phase::Rayleigh(Rayleigh::new(0.0).expect("valid")),
            refractive_index: 1.34,
        })
        .expect("it absorbs");
        let boundary = Boundary {
            height: 0.0,
            index: 1.34,
        };
        let travel = boundary.refract_into_water(DVec3::new(0.75f64.sqrt(), 0.0, -0.5));
        let entering = (1.0 - boundary.external_reflectance(0.5)) * 0.5;
        let sun = SunBeam {
            towards: -travel,
            towards_in_air: DVec3::new(-0.75f64.sqrt(), 0.0, 0.5),
            irradiance: [entering / -travel.z; 3],
            irradiance_in_air: [1.0; 3],
        };
        let field =
            DaylightField::build(&medium, &boundary, Some(&sun), [0.0; 3], 10.0).expect("lit");
        for (depth, down, up) in [(1.0, 0.3659944, 0.1734997), (5.0, 0.04328907, 0.02035448)] {
            let (diffuse, found_up) = field.diffuse_irradiance(depth)[1];
            let beam = entering * (-depth / -travel.z).exp();
            assert!(
                ((diffuse + beam) / down - 1.0).abs() < 0.1,
                "{depth}: {diffuse} + {beam}"
            );
            assert!((found_up / up - 1.0).abs() < 0.1, "{depth}: {found_up}");
        }
    }
}
