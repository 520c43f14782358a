//! What daylight is like far from any object: a plane-parallel estimate that tells walks where light is.
//!
//! Made at start-up from a coarse solution of the transfer equation per channel ([`solver`]). It steers how
//! many copies of a walk go on; whatever its errors, they cannot bias a picture.

mod column;
mod solver;
mod table;
mod transition;
mod worth;

use rayon::prelude::*;
use uw_media::Spectrum;

use super::{Boundary, Layers, Medium, SunBeam};
use column::Column;
use solver::{Daylight, Solution};
use table::{ChannelField, FieldTable};
use transition::Transitions;
use worth::{Lit, Worths};

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

/// Plane-parallel daylight, in layers of water or in the same water everywhere: radiance per direction and depth, irradiances.
#[derive(Clone, Debug)]
pub struct DaylightField {
    pub(crate) table: FieldTable,
    /// Per channel, the share of the light that scatters narrowly per metre of depth, 1/m.
    pub(crate) narrow_rate: Spectrum,
    /// Asymptotic −d ln L/dτ per channel.
    decay: Spectrum,
    pub(crate) sun_azimuth: Option<(f64, f64)>,
}

impl DaylightField {
    /// The daylight down to `deepest_m` (m below the surface) and beyond; `None` where it cannot be or where
    /// nothing scatters.
    pub fn build(
        medium: &Medium,
        boundary: &Boundary,
        sun: Option<&SunBeam>,
        sky: Spectrum,
        deepest_m: f64,
        layers: Option<&Layers>,
    ) -> Option<Self> {
        if !medium.scatters() || (sun.is_none() && sky == [0.0; 3]) {
            return None;
        }
        let transitions = Transitions::build(&medium.phase);
        let channels: Vec<ChannelField<'_>> = (0..3)
            .into_par_iter()
            .map(|k| {
                let column = Column::new(medium.c[k], medium.b[k], layers, k);
                let light = Daylight {
                    column: &column,
                    sun: sun.map(|s| (s.towards.z, s.irradiance[k])),
                    sky: sky[k],
                    boundary: *boundary,
                };
                let max_depth = column.optical_depth(deepest_m) + BELOW;
                let solution = Solution::solve(&light, &transitions, max_depth);
                let lit = Lit {
                    phase: &medium.phase,
                    light: &light,
                    narrow: transitions.narrow,
                };
                let worths = Worths::of(&lit, &solution);
                ChannelField {
                    column,
                    solution,
                    worths,
                }
            })
            .collect();
        let channels: [ChannelField<'_>; 3] = channels.try_into().ok()?;
        let horizontal = |s: &SunBeam| {
            let length = s.towards.truncate().length();
            (length > 1e-2).then(|| (s.towards.x / length, s.towards.y / length))
        };
        let sun_azimuth = sun.and_then(horizontal);
        let strategies = medium.by_attenuation;
        let in_use = &strategies.sigma[..strategies.count];
        let closest_channels: Vec<usize> = in_use.iter().map(|&s| closest(&medium.c, s)).collect();
        let scatters = medium.b.map(|b| b > 0.0);
        let narrow = sun.map_or(0.0, |s| transitions.narrow / s.towards.z);
        Some(Self {
            table: FieldTable::new(
                &channels,
                scatters,
                &closest_channels,
                sun_azimuth.is_some(),
                deepest_m,
            ),
            narrow_rate: medium.b.map(|b| narrow * b),
            decay: channels.map(|c| c.solution.decay),
            sun_azimuth,
        })
    }

    /// How much longer flights upwards should be than downwards: σ(1 − κu) with κ per strategy of `medium`.
    /// Only where absorption makes the light come from above; else 0.
    pub fn stretch(&self, medium: &Medium) -> Spectrum {
        let strategies = &medium.by_attenuation;
        std::array::from_fn(|j| {
            (0..3)
                .filter(|&k| {
                    medium.b[k] > 0.0
                        && (medium.c[k] / strategies.sigma[j]).ln().abs() < STRETCH_MATCH
                })
                .map(|k| {
                    if medium.b[k] < STRETCH_BELOW * medium.c[k] {
                        STRETCH_SHARE * self.decay[k]
                    } else {
                        0.0
                    }
                })
                .reduce(f64::min)
                .unwrap_or(0.0)
        })
    }
}

/// Index of the coefficient closest to `sigma`.
fn closest(c: &Spectrum, sigma: f64) -> usize {
    let apart = |k: usize| (c[k] - sigma).abs();
    (1..3).fold(0, |best, k| if apart(k) < apart(best) { k } else { best })
}

/// Centre of a cosine bin.
fn bin_cosine(bin: usize) -> f64 {
    -1.0 + (bin as f64 + 0.5) * 2.0 / COSINES as f64
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::Water;
    use uw_media::{
        Iops,
        phase::{Phase, Rayleigh},
    };

    /// Diffuse downward and upward irradiance of the second channel, between the nodes of the table.
    fn irradiances(field: &DaylightField, depth_m: f64) -> (f64, f64) {
        let steps = (depth_m / field.table.max_depth_m).sqrt() * (DEPTHS - 1) as f64;
        let (node, weight) = (steps as usize, steps.fract());
        let (_, [_, down, up, _]) = field.table.parts();
        let at = |t: &[[f32; 4]]| {
            let [a, b] = [t[node][1], t[node + 1][1]].map(f64::from);
            (a + weight * (b - a)).exp()
        };
        (at(down), at(up))
    }

    /// Water of an albedo of 0.9 with Rayleigh's phase function below a refracting surface.
    fn water() -> (Medium, Boundary) {
        let medium = Medium::build(&Water {
            iops: Iops {
                a: [0.1; 3],
                b: [0.9; 3],
            },
            phase: Phase::Rayleigh(Rayleigh::new(0.0).expect("valid")),
            refractive_index: 1.34,
            variation: crate::scene::Variation::default(),
        })
        .expect("it absorbs");
        let boundary = Boundary {
            height: 0.0,
            index: 1.34,
        };
        (medium, boundary)
    }

    /// A sun at 60° with 0.5 W/m² on the horizontal, and what of it enters.
    fn low_sun(boundary: &Boundary) -> (SunBeam, f64) {
        let travel = boundary.refract_into_water(DVec3::new(0.75f64.sqrt(), 0.0, -0.5));
        let entering = (1.0 - boundary.external_reflectance(0.5)) * 0.5;
        let sun = SunBeam {
            radius_rad: 0.0,
            towards: -travel,
            towards_in_air: DVec3::new(-0.75f64.sqrt(), 0.0, 0.5),
            irradiance: [entering / -travel.z; 3],
            irradiance_in_air: [1.0; 3],
        };
        (sun, entering)
    }

    /// Mobley et al. 1993, problem 1 (albedo 0.9): E_d and E_u from discrete ordinates, for a sun at 60° with
    /// 0.5 W/m² on the horizontal. A field that only steers may be off by some percent, not by a factor.
    #[test]
    fn irradiances_are_nearly_those_of_discrete_ordinates() {
        let (medium, boundary) = water();
        let (sun, entering) = low_sun(&boundary);
        let field = DaylightField::build(&medium, &boundary, Some(&sun), [0.0; 3], 10.0, None)
            .expect("lit");
        for (depth, down, up) in [(1.0, 0.3659944, 0.1734997), (5.0, 0.04328907, 0.02035448)] {
            let (diffuse, found_up) = irradiances(&field, depth);
            let beam = entering * (-depth / sun.towards.z).exp();
            assert!(
                ((diffuse + beam) / down - 1.0).abs() < 0.1,
                "{depth}: {diffuse} + {beam}"
            );
            assert!((found_up / up - 1.0).abs() < 0.1, "{depth}: {found_up}");
        }
    }

    /// What directions are worth is the light from there over the mean: its own mean is about 1, with a sun and without.
    #[test]
    fn worths_are_over_the_mean_light() {
        let (medium, boundary) = water();
        let (sun, _) = low_sun(&boundary);
        for (sun, sky) in [(Some(sun), 0.0), (Some(sun), 0.3), (None, 0.3)] {
            let field =
                DaylightField::build(&medium, &boundary, sun.as_ref(), [sky; 3], 10.0, None)
                    .expect("lit");
            let (azimuths, [.., worths]) = field.table.parts();
            assert_eq!(worths.len(), DEPTHS * COSINES * azimuths);
            for node in [10, 30, 60] {
                let own = &worths[node * COSINES * azimuths..(node + 1) * COSINES * azimuths];
                let mean = own.iter().map(|worth| f64::from(worth[1])).sum::<f64>();
                // Rayleigh's function is not far from even.
                let even = 1.0 / (4.0 * std::f64::consts::PI);
                let sunlight = own
                    .iter()
                    .map(|worth| f64::from(worth[2]) * even)
                    .sum::<f64>();
                let mean = (mean + sunlight) / own.len() as f64;
                assert!((0.7..1.4).contains(&mean), "{node}: {mean}");
                let shares = if sun.is_some() { 0.09..0.71 } else { 0.0..0.01 };
                assert!(own.iter().all(|worth| shares.contains(&worth[0])));
            }
        }
    }
}
