//! Free flights of walks that look for daylight, and scatterings.
//!
//! What ends a segment has been scored or is followed by a copy of its own, so flights are drawn within the
//! segment; the densities of all strategies are kept, so that the channels' weights stay balanced.

use std::f64::consts::TAU;

use glam::DVec3;

use super::{
    ambient_path::{Tracer, Walk},
    camera_ray::End,
    sun_line::absorbed,
};
use crate::{
    integrator::sampling::directions::{sin2_half, turn},
    prepare::{Prepared, Primitive, Strategies},
};

/// Share of directions drawn around the sun at a scattering where no field tells it.
const SUN_SHARE: f64 = 0.15;
/// Share of directions drawn uniformly in the cone through which the sky is seen.
const SKY_SHARE: f64 = 0.1;
/// Scatterings that may be drawn so: later the light is diffuse, and the weights would spread for nothing.
const SKY_EVENTS: usize = 4;

/// Distance to a scattering that happens before `length`.
pub(crate) fn draw_within(
    scene: &Prepared,
    strategies: &Strategies,
    length: f64,
    u: f64,
    walk: &mut Walk,
) -> f64 {
    let sigma = strategies.sigma[walk.spectral.chosen];
    let t = (-(-u * absorbed(sigma * length)).ln_1p() / sigma).min(length);
    if let Some(medium) = &scene.medium {
        walk.spectral.scatter(medium, strategies, t);
    }
    for j in 0..walk.spectral.count {
        let within = absorbed(strategies.sigma[j] * length);
        walk.spectral.density[j] /= within.max(f64::MIN_POSITIVE);
    }
    t
}

/// What happens next on a segment that ends at the water surface or nowhere: a scattering, or a meeting with
/// the surface. Where everything that leaves has been scored, it always stays.
pub(crate) fn draw_within_water(
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
    let chosen = walk.spectral.chosen;
    let sigma = strategies.sigma[chosen];
    let mut staying = [0.0; 3];
    let mut scattered = 0.0;
    for j in 0..strategies.count {
        let within = absorbed(strategies.sigma[j] * length);
        staying[j] = if leaving == 1.0 {
            within
        } else {
            within + (1.0 - leaving) * (1.0 - within)
        };
        if j == chosen {
            scattered = within;
        }
    }
    let stay = staying[chosen].max(f64::MIN_POSITIVE);
    let reached = (1.0 - leaving) * (1.0 - scattered) / stay;
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
        let t = (-(-v * scattered).ln_1p() / sigma).min(length);
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

/// Expected numbers of directions drawn at a scattering.
#[derive(Clone, Copy, Debug)]
struct Counts {
    /// Around the old direction, per strategy.
    own: [f64; 3],
    /// Around the sun, per strategy.
    sun: [f64; 3],
    /// In the cone through which the sky is seen.
    sky: f64,
}

/// A new direction. The angle from the axis it was drawn around, as sin²(θ/2), is known without cancellation.
#[derive(Clone, Copy, Debug, Default)]
struct Turn {
    direction: DVec3,
    from_old: Option<f64>,
    from_sun: Option<f64>,
}

impl Tracer<'_> {
    /// A scattering after `t`: new directions around the old one, around the sun or towards the sky. The first
    /// scattering makes one of each, later ones one of them.
    pub(super) fn scatter(&mut self, mut walk: Walk, t: f64) {
        let Some(medium) = &self.scene.medium else {
            return;
        };
        walk.go(t);
        walk.from = Primitive::None;
        walk.scattered = true;
        walk.events += 1;
        let (u, v) = walk.direction_numbers(self.draws);
        walk.leading = false;
        let counts = self.counts(&walk);
        let first = walk.events == 1;
        let choice = if first || counts.own == [1.0; 3] {
            1.0
        } else {
            self.draws.uniform()
        };
        let (sun, sky) = (counts.sun[walk.spectral.chosen], counts.sky);
        if let Some(beam) = self.scene.sun.as_ref().filter(|_| first || choice < sun) {
            let x = medium.phase.sample_x(u);
            let turned = Turn {
                direction: turn(beam.towards, x, v),
                from_sun: Some(x),
                from_old: None,
            };
            self.go_along(walk, turned, &counts);
        }
        if sky > 0.0 && (first || (sun <= choice && choice < sun + sky)) {
            let turned = Turn {
                direction: towards_sky(self.lowest_sky(), u, v),
                ..Turn::default()
            };
            self.go_along(walk, turned, &counts);
        }
        if first || choice >= sun + sky {
            let x = medium.phase.sample_x(u);
            let turned = Turn {
                direction: turn(walk.direction, x, v),
                from_old: Some(x),
                from_sun: None,
            };
            self.go_along(walk, turned, &counts);
        }
    }

    /// How many directions of which kind `walk` draws where it scatters now.
    fn counts(&self, walk: &Walk) -> Counts {
        let scene = self.scene;
        let sees_sky = scene.needs.sky && scene.boundary.is_some();
        if walk.events == 1 {
            return Counts {
                own: [1.0; 3],
                sun: [f64::from(u8::from(scene.sun.is_some())); 3],
                sky: f64::from(u8::from(sees_sky)),
            };
        }
        let sun = match (&scene.sun, &scene.daylight) {
            (None, _) => [0.0; 3],
            (Some(_), None) => [SUN_SHARE; 3],
            (Some(_), Some(field)) => field.sun_share(scene.depth(walk.origin), walk.direction),
        };
        let sky = if sees_sky && walk.events <= SKY_EVENTS {
            SKY_SHARE
        } else {
            0.0
        };
        Counts {
            own: sun.map(|share| 1.0 - share - sky),
            sun,
            sky,
        }
    }

    /// Sends a copy of `walk` on along a drawn direction, weighted by all ways of drawing it.
    fn go_along(&mut self, mut walk: Walk, turned: Turn, counts: &Counts) {
        let Some(medium) = &self.scene.medium else {
            return;
        };
        let to = turned.direction;
        let from_old = || sin2_half(walk.direction, to);
        let phase = medium.phase.value(turned.from_old.unwrap_or_else(from_old));
        if !(phase > 0.0) {
            return;
        }
        let around_sun = self.scene.sun.as_ref().map_or(0.0, |sun| {
            let x = turned
                .from_sun
                .unwrap_or_else(|| sin2_half(to, sun.towards));
            medium.phase.value(x) / phase
        });
        let lowest = self.lowest_sky();
        let in_cone = if counts.sky > 0.0 && to.z >= lowest {
            counts.sky / (TAU * (1.0 - lowest)) / phase
        } else {
            0.0
        };
        for j in 0..walk.spectral.count {
            walk.spectral.density[j] *= counts.own[j] + counts.sun[j] * around_sun + in_cone;
        }
        walk.direction = to;
        self.pending.push(walk);
    }

    /// Cosine of the edge of the cone through which the sky is seen from below.
    fn lowest_sky(&self) -> f64 {
        let index = self.scene.boundary.map_or(1.0, |b| b.index);
        (1.0 - (index * index).recip()).max(0.0).sqrt()
    }
}

/// A direction drawn uniformly among those with a vertical component of at least `lowest`.
fn towards_sky(lowest: f64, u: f64, v: f64) -> DVec3 {
    let up = lowest + (1.0 - lowest) * u;
    let across = (1.0 - up * up).max(0.0).sqrt();
    let (sin, cos) = (TAU * v).sin_cos();
    DVec3::new(across * cos, across * sin, up)
}
