//! Directions in which an irradiance sensor looks.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::{
    prepare::{Medium, Prepared, SunBeam},
    sampling::directions::{sin2_half, turn},
};

/// Where a sensor looks: against the light that it measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gaze {
    /// The upper hemisphere: light that travels down.
    Up,
    /// The lower hemisphere: light that travels up.
    Down,
    /// Straight down only.
    Nadir,
}

impl Gaze {
    /// In the order of tasks and of results.
    pub(super) const ALL: [Self; 3] = [Self::Up, Self::Down, Self::Nadir];
}

/// Share of the upward directions drawn around the sun, where its light is scattered.
const SUN_SHARE: f64 = 0.4;
/// Share of the other directions drawn with the cosine's density; the rest is uniform, so that neither plane nor
/// scalar irradiance has an unbounded weight.
const COSINE_SHARE: f64 = 0.5;

/// The mixture that directions are drawn from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lobes<'a> {
    sun: Option<(&'a SunBeam, &'a Medium)>,
}

impl<'a> Lobes<'a> {
    pub(super) fn new(scene: &'a Prepared) -> Self {
        let medium = scene.medium.as_ref().filter(|m| m.scatters());
        Self {
            sun: scene.sun.as_ref().zip(medium),
        }
    }

    /// A unit direction and its density, 1/sr (1 for a single direction), from two numbers in (0, 1); `None` where
    /// the lobe around the sun leaves the hemisphere.
    pub(super) fn draw(&self, gaze: Gaze, u: f64, v: f64) -> Option<(DVec3, f64)> {
        match gaze {
            Gaze::Nadir => Some((-DVec3::Z, 1.0)),
            Gaze::Down => {
                let direction = -hemisphere(u, v);
                Some((direction, hemisphere_density(-direction.z)))
            }
            Gaze::Up => self.draw_up(u, v),
        }
    }

    fn draw_up(&self, u: f64, v: f64) -> Option<(DVec3, f64)> {
        let Some((sun, medium)) = self.sun else {
            let direction = hemisphere(u, v);
            return Some((direction, hemisphere_density(direction.z)));
        };
        let direction = if u < SUN_SHARE {
            turn(sun.towards, medium.phase.sample_x(u / SUN_SHARE), v)
        } else {
            hemisphere((u - SUN_SHARE) / (1.0 - SUN_SHARE), v)
        };
        let around_sun = medium.phase.value(sin2_half(direction, sun.towards));
        let density = SUN_SHARE * around_sun + (1.0 - SUN_SHARE) * hemisphere_density(direction.z);
        (direction.z > 0.0).then_some((direction, density))
    }
}

/// A direction with z > 0 from the cosine's or the uniform density.
fn hemisphere(u: f64, v: f64) -> DVec3 {
    let z = if u < COSINE_SHARE {
        (1.0 - u / COSINE_SHARE).sqrt()
    } else {
        (1.0 - u) / (1.0 - COSINE_SHARE)
    };
    let z = z.clamp(f64::MIN_POSITIVE, 1.0);
    let (sin, cos) = (TAU * v).sin_cos();
    let horizontal = ((1.0 - z) * (1.0 + z)).sqrt();
    DVec3::new(horizontal * cos, horizontal * sin, z)
}

fn hemisphere_density(cosine: f64) -> f64 {
    COSINE_SHARE * cosine / PI + (1.0 - COSINE_SHARE) / TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Rng;

    /// Directions with their density integrate any function: solid angle and cosine over each hemisphere.
    #[test]
    fn directions_have_the_density_they_state() {
        let water = uw_media::Iops {
            a: [0.1; 3],
            b: [0.9; 3],
        };
        let medium = Medium::build(&crate::scene::Water {
            iops: water,
            phase: uw_media::phase::Phase::HenyeyGreenstein(
                uw_media::phase::HenyeyGreenstein::new(0.9).expect("valid"),
            ),
            refractive_index: 1.34,
            variation: crate::scene::Variation::default(),
        })
        .expect("scatters");
        let sun = SunBeam {
            radius_rad: 0.0,
            towards: DVec3::new(0.6, 0.0, 0.8),
            towards_in_air: DVec3::new(0.8, 0.0, 0.6),
            irradiance: [1.0; 3],
            irradiance_in_air: [1.0; 3],
        };
        let lobes = Lobes {
            sun: Some((&sun, &medium)),
        };
        let mut rng = Rng::new(1, 2, 3, 4);
        const N: usize = 200_000;
        for (gaze, side) in [(Gaze::Up, 1.0), (Gaze::Down, -1.0)] {
            let (mut solid_angle, mut plane, mut azimuthal) = (0.0, 0.0, 0.0);
            for _ in 0..N {
                let Some((d, density)) = lobes.draw(gaze, rng.uniform(), rng.uniform()) else {
                    continue;
                };
                assert!(side * d.z > 0.0 && (d.length() - 1.0).abs() < 1e-12);
                solid_angle += 1.0 / density / N as f64;
                plane += side * d.z / density / N as f64;
                azimuthal += d.x / density / N as f64;
            }
            // Weights are at most 2 TAU / (1 - SUN_SHARE): standard errors below 0.02.
            assert!((solid_angle / TAU - 1.0).abs() < 0.01, "{solid_angle}");
            assert!((plane / PI - 1.0).abs() < 0.01, "{plane}");
            assert!(azimuthal.abs() < 0.05, "{azimuthal}");
        }
    }
}
