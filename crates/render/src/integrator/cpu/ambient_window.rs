//! How many copies of a walk go on: a weight window steered by an estimate of the light ahead.
//!
//! After everything on a segment has been scored, the light that a walk can still bring is estimated from
//! the plane-parallel field of the water and from the surface it is going to meet, relative to what its first
//! segment promised for the pixel. Little of it: roulette. Much of it: several copies. The estimate steers
//! only; whatever its errors, the expectation is exact.

use std::f64::consts::PI;

use super::{LATE_SURVIVAL, SURE_EVENTS, ambient_path::Walk, camera_ray::End};
use crate::{
    integrator::sampling::Draws,
    prepare::{Prepared, SurfacePoint},
};

/// Relative expected light below which roulette sets in.
const LOWEST: f64 = 0.5;
/// Relative expected light above which copies are made.
const HIGHEST: f64 = 2.0;
/// Most copies at one place.
const MOST_COPIES: f64 = 16.0;
/// Most copies made in one sample: an estimate that is wrong by orders of magnitude costs time only so long.
const COPIES_PER_SAMPLE: usize = 256;
/// Least probability of going on: bounds the weight when the estimate is far too low.
const LEAST_SURVIVAL: f64 = 0.02;
/// Share of the largest emission that is assumed to lie ahead everywhere in the water.
const EMISSION_AHEAD: f64 = 0.1;

/// What the pixel is expected to show, per channel, from the first segment on.
#[derive(Clone, Copy, Debug, Default)]
pub struct Window {
    reference: Option<[f64; 3]>,
    copies_made: usize,
}

impl Window {
    /// Sets what the sample is expected to bring: weight times expected radiance. Only the first call counts.
    pub fn set_reference(&mut self, weight: [f64; 3], expected: [f64; 3]) {
        self.reference
            .get_or_insert_with(|| std::array::from_fn(|k| weight[k] * expected[k]));
    }

    /// Light ahead relative to the reference, in the channel that has most of it: a walk that is worth following for one
    /// channel is, however little the others see by it.
    fn relative(&self, weight: [f64; 3], light: [f64; 3]) -> f64 {
        let Some(reference) = self.reference else {
            return 1.0;
        };
        let share = |k: usize| {
            if reference[k] > 0.0 {
                weight[k] * light[k] / reference[k]
            } else {
                0.0
            }
        };
        share(0).max(share(1)).max(share(2))
    }

    /// Probability with which a walk goes on that is not copied.
    pub fn survival(&self, weight: [f64; 3], light: [f64; 3]) -> f64 {
        survival(self.relative(weight, light))
    }

    /// Number of copies that go on and the factor of the weight of each, for a walk after `events`.
    pub fn copies(
        &mut self,
        weight: [f64; 3],
        light: [f64; 3],
        events: usize,
        draws: &mut Draws,
    ) -> (usize, f64) {
        let value = self.relative(weight, light);
        if value > HIGHEST && self.copies_made < COPIES_PER_SAMPLE && events <= SURE_EVENTS {
            let copies = value.round().min(MOST_COPIES);
            self.copies_made += copies as usize - 1;
            return (copies as usize, 1.0 / copies);
        }
        // Nothing else ends a path between lossless surfaces in lossless water.
        let patience = if events > SURE_EVENTS {
            LATE_SURVIVAL
        } else {
            1.0
        };
        let survival = survival(value) * patience;
        if survival >= 1.0 {
            return (1, 1.0);
        }
        if !(survival > 0.0) || draws.uniform() >= survival {
            return (0, 0.0);
        }
        (1, 1.0 / survival)
    }
}

/// Roulette below the window; certain death only where nothing at all is ahead.
fn survival(value: f64) -> f64 {
    if value > 0.0 {
        (value / LOWEST).clamp(LEAST_SURVIVAL, 1.0)
    } else {
        0.0
    }
}

/// Light that has still to be found in the water along a segment, apart from a surface at its end; `line` is
/// the sunlight scattered once on it.
pub fn light_ahead(scene: &Prepared, walk: &Walk, end: &End, line: [f64; 3]) -> [f64; 3] {
    let Some(field) = &scene.daylight else {
        return scene.ambient_scale;
    };
    let depth = scene.depth(walk.origin);
    let mut light = field.scattered(depth, walk.direction, line);
    for k in 0..3 {
        light[k] += EMISSION_AHEAD * scene.largest_emission[k];
    }
    if let (End::Surface(t, ..), Some(medium)) = (end, &scene.medium) {
        for k in 0..3 {
            light[k] *= -(-medium.c[k] * t).exp_m1();
        }
    }
    light
}

/// Light from the surface at `t`, attenuated on the way: what it emits and what it reflects.
pub fn light_on_surface(scene: &Prepared, walk: &Walk, t: f64, point: &SurfacePoint) -> [f64; 3] {
    let transmittance = scene
        .medium
        .as_ref()
        .map_or([1.0; 3], |m| m.transmittance(t));
    let position = walk.origin + t * walk.direction;
    let diffuse = diffuse_irradiance(scene, walk, scene.depth(position), point);
    std::array::from_fn(|k| {
        let sun = direct_irradiance(scene, scene.depth(position), point, k);
        let reflected = point.reflectance[k] * (diffuse[k] + sun) / PI;
        transmittance[k] * (point.emission[k] + reflected)
    })
}

/// Irradiance on a surface by everything but the sun's own beam, W/m² per channel.
pub fn diffuse_irradiance(
    scene: &Prepared,
    walk: &Walk,
    depth_m: f64,
    point: &SurfacePoint,
) -> [f64; 3] {
    let field = scene.daylight.as_ref().filter(|_| !walk.in_air);
    let Some(field) = field else {
        return scene.ambient_scale.map(|l| PI * l);
    };
    // Between upwards and downwards the irradiance is taken to change linearly with the normal's height.
    let upwards = 0.5 * (1.0 + point.shading_normal.z);
    let planes = field.diffuse_irradiance(depth_m);
    std::array::from_fn(|k| {
        let (down, up) = planes[k];
        upwards * down + (1.0 - upwards) * up + PI * EMISSION_AHEAD * scene.largest_emission[k]
    })
}

/// Irradiance by the sun's own beam, without regard to shadows.
fn direct_irradiance(scene: &Prepared, depth_m: f64, point: &SurfacePoint, k: usize) -> f64 {
    let Some(sun) = &scene.sun else {
        return 0.0;
    };
    let cosine = point.shading_normal.dot(sun.towards).max(0.0);
    let c = scene.medium.as_ref().map_or(0.0, |m| m.c[k]);
    sun.irradiance[k] * cosine * (-c * depth_m / sun.towards.z).exp()
}
