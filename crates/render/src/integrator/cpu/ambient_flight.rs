//! Free flights of walks that look for daylight, and scatterings.
//!
//! What ends a segment has been scored or is followed by a copy of its own, so flights are drawn within the
//! segment; the densities of all strategies are kept, so that the channels' weights stay balanced.

use std::f64::consts::TAU;

use glam::DVec3;

use super::{
    ambient_path::{Tracer, Walk},
    camera_ray::End,
};
use crate::{
    integrator::sampling::directions::{sin2_half, turn},
    prepare::{Boundary, Prepared, Primitive, Strategies},
};

/// Share of directions drawn around the sun at a scattering.
const SUN_SHARE: f64 = 0.15;
/// Share of directions drawn uniformly in the cone through which the sky is seen.
const SKY_SHARE: f64 = 0.1;
/// Scatterings that may be drawn so: later the light is diffuse, and the weights would spread for nothing.
const SKY_EVENTS: usize = 4;

/// Distance to a scattering that happens before `length`.
pub(super) fn draw_within(
    scene: &Prepared,
    strategies: &Strategies,
    length: f64,
    u: f64,
    walk: &mut Walk,
) -> f64 {
    let sigma = strategies.sigma[walk.spectral.chosen];
    let t = (-(u * (-sigma * length).exp_m1()).ln_1p() / sigma).min(length);
    if let Some(medium) = &scene.medium {
        walk.spectral.scatter(medium, strategies, t);
    }
    for j in 0..walk.spectral.count {
        let within = -(-strategies.sigma[j] * length).exp_m1();
        walk.spectral.density[j] /= within.max(f64::MIN_POSITIVE);
    }
    t
}

/// What happens next on a segment that ends at the water surface or nowhere: a scattering, or a meeting with
/// the surface. Where everything that leaves has been scored, it always stays.
pub(super) fn draw_within_water(
    scene: &Prepared,
    strategies: &Strategies,
    end: &End,
    u: f64,
    walk: &mut Walk,
) -> End {
    let End::Boundary(length) = *end else {
        return free_flight(scene, strategies, u, walk);
    };
    let escapes_scored = !scene.needs.geometry_in_air;
    let reflectance = scene
        .boundary
        .map_or(0.0, |b| b.internal_reflectance(walk.direction.z));
    let leaving = if escapes_scored {
        1.0 - reflectance
    } else {
        0.0
    };
    let (Some(medium), true) = (&scene.medium, strategies.count > 0) else {
        if let Some(medium) = &scene.medium {
            walk.spectral.pass_surely(medium, length);
        }
        walk.spectral.scale_all(1.0 - leaving);
        return *end;
    };
    // Probability of staying in the water, per strategy: what leaves has been scored.
    let staying = strategies.sigma.map(|s| {
        if leaving == 1.0 {
            -(-s * length).exp_m1()
        } else {
            1.0 - leaving * (-s * length).exp()
        }
    });
    let sigma = strategies.sigma[walk.spectral.chosen];
    let stay = staying[walk.spectral.chosen].max(f64::MIN_POSITIVE);
    let reached = (1.0 - leaving) * (-sigma * length).exp() / stay;
    let result = if u < reached {
        walk.spectral.pass(medium, strategies, length);
        if escapes_scored {
            walk.spectral.scale_all(reflectance);
            for density in &mut walk.spectral.density {
                *density *= reflectance;
            }
        }
        *end
    } else {
        let v = (u - reached) / (1.0 - reached);
        let t = (-(v * (-sigma * length).exp_m1()).ln_1p() / sigma).min(length);
        walk.spectral.scatter(medium, strategies, t);
        End::Scatter(t)
    };
    for j in 0..walk.spectral.count {
        walk.spectral.density[j] /= staying[j].max(f64::MIN_POSITIVE);
    }
    result
}

/// A flight in water that goes on for ever.
fn free_flight(scene: &Prepared, strategies: &Strategies, u: f64, walk: &mut Walk) -> End {
    let (Some(medium), true) = (&scene.medium, strategies.count > 0) else {
        return End::Nothing;
    };
    let t = -u.ln() / strategies.sigma[walk.spectral.chosen];
    walk.spectral.scatter(medium, strategies, t);
    End::Scatter(t)
}

impl Tracer<'_> {
    /// A scattering after `t`: a new direction around the old one, around the sun or towards the sky.
    pub(super) fn scatter(&mut self, mut walk: Walk, t: f64) {
        let scene = self.scene;
        let Some(medium) = &scene.medium else {
            return;
        };
        walk.go(t);
        walk.from = Primitive::None;
        walk.scattered = true;
        walk.events += 1;
        let (u, v) = walk.direction_numbers(self.draws);
        let window = scene
            .boundary
            .filter(|_| scene.needs.sky && walk.events <= SKY_EVENTS)
            .map(|b| sky_cone(&b));
        let sun_share = if scene.sun.is_some() { SUN_SHARE } else { 0.0 };
        let sky_share = if window.is_some() { SKY_SHARE } else { 0.0 };
        let old = walk.direction;
        let choice = if sun_share + sky_share > 0.0 {
            self.draws.uniform()
        } else {
            1.0
        };
        // The angle from the axis it was drawn around is known without cancellation.
        let (mut own, mut from_sun) = (None, None);
        walk.direction = match (&scene.sun, window) {
            (Some(sun), _) if choice < sun_share => {
                let x = medium.phase.sample_x(u);
                from_sun = Some(x);
                turn(sun.towards, x, v)
            }
            (_, Some(lowest)) if choice < sun_share + sky_share => {
                let up = lowest + (1.0 - lowest) * u;
                let across = (1.0 - up * up).max(0.0).sqrt();
                let (sin, cos) = (TAU * v).sin_cos();
                DVec3::new(across * cos, across * sin, up)
            }
            _ => {
                let x = medium.phase.sample_x(u);
                own = Some(x);
                turn(old, x, v)
            }
        };
        if sun_share + sky_share > 0.0 {
            let phase = medium
                .phase
                .value(own.unwrap_or_else(|| sin2_half(old, walk.direction)));
            let mut density = (1.0 - sun_share - sky_share) * phase;
            if let Some(sun) = &scene.sun {
                let x = from_sun.unwrap_or_else(|| sin2_half(walk.direction, sun.towards));
                density += sun_share * medium.phase.value(x);
            }
            if let Some(lowest) = window.filter(|&lowest| walk.direction.z >= lowest) {
                density += sky_share / (TAU * (1.0 - lowest));
            }
            if !(phase > 0.0) {
                return;
            }
            walk.spectral.scale_all(phase / density);
        }
        walk.leading = false;
        self.pending.push(walk);
    }
}

/// Cosine of the edge of the cone through which the sky is seen from below.
fn sky_cone(boundary: &Boundary) -> f64 {
    (1.0 - (boundary.index * boundary.index).recip())
        .max(0.0)
        .sqrt()
}
