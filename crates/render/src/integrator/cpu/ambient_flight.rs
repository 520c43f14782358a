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
    integrator::sampling::{
        circle,
        directions::{sin2_half, turn},
    },
    prepare::{Medium, Prepared, Primitive, Strategies},
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
    let leaving = leaving_scored(scene, walk.direction.z);
    let (Some(medium), true) = (&scene.medium, strategies.count > 0) else {
        if let Some(medium) = &scene.medium {
            walk.spectral.pass_surely(medium, length);
        }
        walk.spectral.scale_all(1.0 - leaving);
        return *end;
    };
    let chosen = walk.spectral.chosen;
    let sigma = strategies.sigma[chosen];
    let staying = staying(strategies, length, leaving);
    let scattered = absorbed(sigma * length);
    let stay = staying[chosen];
    let reached = (1.0 - leaving) * (1.0 - scattered) / stay;
    let result = if u < reached {
        walk.spectral.pass(medium, strategies, length);
        walk.spectral.scale_all(1.0 - leaving);
        for density in &mut walk.spectral.density {
            *density *= 1.0 - leaving;
        }
        *end
    } else {
        let v = (u - reached) / (1.0 - reached);
        let t = (-(-v * scattered).ln_1p() / sigma).min(length);
        walk.spectral.scatter(medium, strategies, t);
        End::Scatter(t)
    };
    for j in 0..walk.spectral.count {
        walk.spectral.density[j] /= staying[j];
    }
    result
}

/// Share of what meets the water surface at a vertical component `up` that leaves through it and has been scored.
fn leaving_scored(scene: &Prepared, up: f64) -> f64 {
    let reflectance = scene.boundary.map_or(0.0, |b| b.internal_reflectance(up));
    if scene.needs.geometry_in_air {
        0.0
    } else {
        1.0 - reflectance
    }
}

/// Probability of staying in the water on a segment of `length` to its surface, per strategy, where `leaving` of what
/// gets there is left out. Positive.
fn staying(strategies: &Strategies, length: f64, leaving: f64) -> [f64; 3] {
    let mut shares = [1.0; 3];
    for (share, sigma) in shares
        .iter_mut()
        .zip(strategies.sigma)
        .take(strategies.count)
    {
        let within = absorbed(sigma * length);
        *share = if leaving == 1.0 {
            within
        } else {
            within + (1.0 - leaving) * (1.0 - within)
        }
        .max(f64::MIN_POSITIVE);
    }
    shares
}

/// The same for a segment with this `end`, along a direction of vertical component `up`.
pub(super) fn staying_shares(
    scene: &Prepared,
    strategies: &Strategies,
    end: &End,
    up: f64,
) -> [f64; 3] {
    match end {
        End::Boundary(length) => staying(strategies, *length, leaving_scored(scene, up)),
        _ => [1.0; 3],
    }
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
pub(super) struct Turn {
    pub(super) direction: DVec3,
    pub(super) from_old: Option<f64>,
    from_sun: Option<f64>,
}

impl Turn {
    fn around_sun(scene: &Prepared, medium: &Medium, u: f64, v: f64) -> Option<Self> {
        let beam = scene.sun.as_ref()?;
        let x = medium.phase.sample_x(u);
        Some(Self {
            direction: turn(beam.towards, x, v),
            from_sun: Some(x),
            from_old: None,
        })
    }

    fn around(old: DVec3, medium: &Medium, u: f64, v: f64) -> Self {
        let x = medium.phase.sample_x(u);
        Self {
            direction: turn(old, x, v),
            from_old: Some(x),
            from_sun: None,
        }
    }

    fn to_sky(scene: &Prepared, u: f64, v: f64) -> Self {
        Self {
            direction: towards_sky(lowest_sky(scene), u, v),
            ..Self::default()
        }
    }

    /// Density of drawing the direction around the sun, 1/sr.
    fn sun_density(&self, scene: &Prepared, medium: &Medium) -> f64 {
        scene.sun.as_ref().map_or(0.0, |sun| {
            let x = self
                .from_sun
                .unwrap_or_else(|| sin2_half(self.direction, sun.towards));
            medium.phase.value(x)
        })
    }

    /// Density of drawing the direction towards the sky, 1/sr.
    fn sky_density(&self, scene: &Prepared) -> f64 {
        let lowest = lowest_sky(scene);
        if self.direction.z >= lowest {
            1.0 / (TAU * (1.0 - lowest))
        } else {
            0.0
        }
    }

    /// Expected density, at a first scattering, of the directions that are not drawn around the old one, 1/sr.
    pub(super) fn other_density(&self, scene: &Prepared, medium: &Medium) -> f64 {
        let sky = if sees_sky(scene) {
            self.sky_density(scene)
        } else {
            0.0
        };
        self.sun_density(scene, medium) + sky
    }
}

impl Tracer<'_> {
    /// A scattering after `t`: new directions around the old one, around the sun or towards the sky. The first
    /// scattering makes one of each, later ones one of them.
    pub(super) fn scatter(&mut self, mut walk: Walk, t: f64) {
        let scene = self.scene;
        let Some(medium) = &scene.medium else {
            return;
        };
        let (u, v) = self.arrive(&mut walk, t);
        let counts = self.counts(&walk);
        if walk.events == 1 {
            for turned in self.first_turns(&walk, u, v).into_iter().flatten() {
                self.go_along(walk, turned, &counts);
            }
            return;
        }
        let choice = if counts.own == [1.0; 3] {
            1.0
        } else {
            self.draws.uniform()
        };
        let (sun, sky) = (counts.sun[walk.spectral.chosen], counts.sky);
        let turned = if choice < sun {
            Turn::around_sun(scene, medium, u, v)
        } else if choice < sun + sky {
            Some(Turn::to_sky(scene, u, v))
        } else {
            Some(Turn::around(walk.direction, medium, u, v))
        };
        if let Some(turned) = turned {
            self.go_along(walk, turned, &counts);
        }
    }

    /// Takes the walk to its scattering after `t`; returns two numbers for the new direction.
    pub(super) fn arrive(&mut self, walk: &mut Walk, t: f64) -> (f64, f64) {
        walk.go(t);
        walk.from = Primitive::None;
        walk.scattered = true;
        walk.events += 1;
        let numbers = walk.direction_numbers(self.draws);
        walk.leading = false;
        numbers
    }

    /// The directions of a first scattering: around the sun, towards the sky, around the old one.
    pub(super) fn first_turns(&self, walk: &Walk, u: f64, v: f64) -> [Option<Turn>; 3] {
        let scene = self.scene;
        let Some(medium) = &scene.medium else {
            return [None; 3];
        };
        [
            Turn::around_sun(scene, medium, u, v),
            sees_sky(scene).then(|| Turn::to_sky(scene, u, v)),
            Some(Turn::around(walk.direction, medium, u, v)),
        ]
    }

    /// How many directions of which kind `walk` draws where it scatters now.
    fn counts(&self, walk: &Walk) -> Counts {
        let scene = self.scene;
        let sees_sky = sees_sky(scene);
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
        let around_sun = turned.sun_density(self.scene, medium) / phase;
        let in_cone = if counts.sky > 0.0 {
            counts.sky * turned.sky_density(self.scene) / phase
        } else {
            0.0
        };
        for j in 0..walk.spectral.count {
            walk.spectral.density[j] *= counts.own[j] + counts.sun[j] * around_sun + in_cone;
        }
        walk.direction = to;
        self.pending.push(walk);
    }
}

/// Whether walks look for the sky through the water surface.
fn sees_sky(scene: &Prepared) -> bool {
    scene.needs.sky && scene.boundary.is_some()
}

/// Cosine of the edge of the cone through which the sky is seen from below.
fn lowest_sky(scene: &Prepared) -> f64 {
    let index = scene.boundary.map_or(1.0, |b| b.index);
    (1.0 - (index * index).recip()).max(0.0).sqrt()
}

/// A direction drawn uniformly among those with a vertical component of at least `lowest`.
fn towards_sky(lowest: f64, u: f64, v: f64) -> DVec3 {
    let up = lowest + (1.0 - lowest) * u;
    let across = (1.0 - up * up).max(0.0).sqrt();
    let (sin, cos) = circle(v);
    DVec3::new(across * cos, across * sin, up)
}
