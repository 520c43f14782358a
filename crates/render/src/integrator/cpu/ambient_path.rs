//! Daylight and emitting surfaces: a camera walk that scores sun and sky along every segment.
//!
//! The sun is scored in closed form along each segment ([`super::sun_line`]), the sky in expectation where a
//! segment leads to the water surface. Directions come from a mixture of the phase function around the old
//! direction and around the sun, so that no weight times the next phase value is unbounded; no path escapes
//! through the surface, because what escapes has been scored.

use glam::DVec3;

use super::{
    LATE_SURVIVAL, SURE_EVENTS,
    ambient_surface::meet_surface,
    camera_ray::{CameraRay, End},
    score::{Scores, Source, Way},
    spectral::Spectral,
    sun_line::{Line, scattered_sunlight},
    unfold::flip,
};
use crate::{
    integrator::sampling::{
        Draws,
        directions::{sin2_half, turn},
    },
    prepare::{Boundary, Medium, Prepared, Primitive, Strategies},
};

/// Share of directions drawn around the sun at a scattering.
const SUN_SHARE: f64 = 0.15;
/// Relative importance below which roulette sets in.
const ROULETTE_BELOW: f64 = 0.1;

pub(super) struct Walk {
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
    pub(super) from: Primitive,
    pub(super) in_air: bool,
    pub(super) scattered: bool,
    pub(super) met_surface: bool,
    pub(super) events: usize,
    pub(super) spectral: Spectral,
}

/// Traces one walk from `ray` and adds ambient light to `scores`; returns the number of path vertices made.
pub fn trace(
    scene: &Prepared,
    ray: &CameraRay,
    max_events: usize,
    draws: &mut Draws,
    scores: &mut Scores,
) -> u64 {
    let strategies = scene
        .medium
        .as_ref()
        .map(|m| m.by_attenuation)
        .unwrap_or_default();
    let mut walk = Walk {
        origin: ray.origin,
        direction: ray.direction,
        from: Primitive::None,
        in_air: scene.in_air(ray.origin),
        scattered: false,
        met_surface: false,
        events: 0,
        spectral: Spectral::start(&strategies, draws.uniform()),
    };
    let start_z = ray.origin.z;
    let mut vertices = 0;
    let mut first = Some(ray);
    loop {
        vertices += 1;
        let leading = first.is_some();
        let alive = if walk.in_air {
            air_segment(scene, max_events, &mut walk, draws, scores)
        } else {
            let known = first.take().filter(|r| r.air_length == 0.0);
            water_segment(
                scene,
                known,
                max_events,
                leading,
                &strategies,
                &mut walk,
                draws,
                scores,
            )
        };
        first = None;
        if !alive || !survives(scene, start_z, &mut walk, draws) {
            return vertices;
        }
    }
}

impl Walk {
    pub(super) fn score(&self, scores: &mut Scores, way: Way, light: [f64; 3]) {
        let weight = self.spectral.weight();
        scores.add(
            Source::Ambient,
            way,
            std::array::from_fn(|k| weight[k] * light[k]),
        );
    }

    pub(super) fn way(&self) -> Way {
        Way::of(self.met_surface, self.scattered)
    }

    fn go(&mut self, t: f64) {
        self.origin += t * self.direction;
    }
}

/// One segment in the water (or in space without water). False when the walk ends.
fn water_segment(
    scene: &Prepared,
    known: Option<&CameraRay>,
    max_events: usize,
    leading: bool,
    strategies: &Strategies,
    walk: &mut Walk,
    draws: &mut Draws,
    scores: &mut Scores,
) -> bool {
    let end = known.map_or_else(|| full_segment(scene, walk), CameraRay::end);
    let length = end.distance().unwrap_or(f64::INFINITY);
    if let (Some(medium), true) = (&scene.medium, walk.events < max_events) {
        let line = Line {
            origin: walk.origin,
            direction: walk.direction,
            length,
        };
        let light = scattered_sunlight(scene, medium, &line, draws);
        walk.score(scores, Way::of(walk.met_surface, true), light);
    }
    let reflectance = match (&end, &scene.boundary) {
        (End::Boundary(_), Some(b)) => b.internal_reflectance(walk.direction.z),
        _ => 0.0,
    };
    let escapes_scored = score_sky(scene, &end, reflectance, walk, scores);
    let u = if leading {
        draws.leading(2)
    } else {
        draws.uniform()
    };
    let flight = next_event(scene, strategies, end, reflectance, escapes_scored, u, walk);
    match flight {
        End::Scatter(t) => walk.events < max_events && scatter(scene, t, leading, walk, draws),
        End::Surface(t, point, primitive) => {
            walk.go(t);
            walk.from = primitive;
            meet_surface(scene, &point, max_events, leading, walk, draws, scores)
        }
        End::Boundary(t) => {
            walk.go(t);
            leave_boundary(scene, reflectance, escapes_scored, walk, draws)
        }
        End::Nothing => false,
    }
}

/// The end of the segment if nothing scattered on it.
fn full_segment(scene: &Prepared, walk: &Walk) -> End {
    let to_boundary = scene.distance_to_boundary(walk.origin, walk.direction);
    match scene
        .geometry
        .closest(walk.origin, walk.direction, to_boundary, walk.from)
    {
        Some(hit) => End::Surface(
            hit.t,
            scene.geometry.surface_point(&hit, walk.direction),
            hit.primitive,
        ),
        None if to_boundary < f64::INFINITY => End::Boundary(to_boundary),
        None => End::Nothing,
    }
}

/// Scores the sky at the end of the segment; returns whether everything that leaves through the surface has
/// thereby been counted.
fn score_sky(
    scene: &Prepared,
    end: &End,
    reflectance: f64,
    walk: &Walk,
    scores: &mut Scores,
) -> bool {
    let sky = |transmittance: [f64; 3], factor: f64| {
        std::array::from_fn(|k| scene.sky[k] * transmittance[k] * factor)
    };
    let through = |t: f64| {
        scene
            .medium
            .as_ref()
            .map_or([1.0; 3], |m| m.transmittance(t))
    };
    match (end, &scene.boundary) {
        (End::Boundary(t), Some(boundary)) => {
            if scene.needs.geometry_in_air {
                return false;
            }
            let factor = (1.0 - reflectance) * boundary.index * boundary.index;
            walk.score(scores, walk.way(), sky(through(*t), factor));
            true
        }
        (End::Nothing, boundary) => {
            if boundary.is_none() || scene.medium.is_none() {
                walk.score(scores, walk.way(), sky(through(f64::INFINITY), 1.0));
            }
            true
        }
        _ => true,
    }
}

/// Draws what happens on the segment and passes the weights.
fn next_event(
    scene: &Prepared,
    strategies: &Strategies,
    end: End,
    reflectance: f64,
    escapes_scored: bool,
    u: f64,
    walk: &mut Walk,
) -> End {
    let Some(medium) = &scene.medium else {
        if matches!(end, End::Boundary(_)) && escapes_scored {
            walk.spectral.scale_all(reflectance);
        }
        return end;
    };
    if strategies.count == 0 {
        if let Some(t) = end.distance() {
            walk.spectral.pass_surely(medium, t);
        }
        if matches!(end, End::Boundary(_)) && escapes_scored {
            walk.spectral.scale_all(reflectance);
        }
        return if reflectance == 0.0 && escapes_scored && matches!(end, End::Boundary(_)) {
            End::Nothing
        } else {
            end
        };
    }
    let sigma = strategies.sigma[walk.spectral.chosen];
    let End::Boundary(length) = end else {
        let t = -u.ln() / sigma;
        return match end.distance() {
            Some(length) if t >= length => {
                walk.spectral.pass(medium, strategies, length);
                end
            }
            _ => {
                walk.spectral.scatter(medium, strategies, t);
                End::Scatter(t)
            }
        };
    };
    let leaving = if escapes_scored {
        1.0 - reflectance
    } else {
        0.0
    };
    // Probability of staying in the water, per strategy: what leaves has been scored.
    let staying = strategies.sigma.map(|s| {
        if leaving == 1.0 {
            -(-s * length).exp_m1()
        } else {
            1.0 - leaving * (-s * length).exp()
        }
    });
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
        end
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

/// A scattering after `t`: a new direction around the old one or around the sun.
fn scatter(scene: &Prepared, t: f64, leading: bool, walk: &mut Walk, draws: &mut Draws) -> bool {
    let Some(medium) = &scene.medium else {
        return false;
    };
    walk.go(t);
    walk.from = Primitive::None;
    walk.scattered = true;
    walk.events += 1;
    let (u, v) = if leading {
        (draws.leading(3), draws.leading(4))
    } else {
        (draws.uniform(), draws.uniform())
    };
    let Some(sun) = &scene.sun else {
        walk.direction = turn(walk.direction, medium.phase.sample_x(u), v);
        return true;
    };
    let around_sun = draws.uniform() < SUN_SHARE;
    let axis = if around_sun {
        sun.towards
    } else {
        walk.direction
    };
    let x = medium.phase.sample_x(u);
    let direction = turn(axis, x, v);
    let own = if around_sun {
        sin2_half(direction, walk.direction)
    } else {
        x
    };
    let from_sun = if around_sun {
        x
    } else {
        sin2_half(direction, sun.towards)
    };
    let phase = medium.phase.value(own);
    let density = (1.0 - SUN_SHARE) * phase + SUN_SHARE * medium.phase.value(from_sun);
    walk.direction = direction;
    if !(phase > 0.0) {
        return false;
    }
    walk.spectral.scale_all(phase / density);
    true
}

/// At the underside of the water surface: reflected, or into the air where there is something to see.
fn leave_boundary(
    scene: &Prepared,
    reflectance: f64,
    escapes_scored: bool,
    walk: &mut Walk,
    draws: &mut Draws,
) -> bool {
    let Some(boundary) = scene.boundary else {
        return false;
    };
    walk.origin.z = boundary.height;
    walk.from = Primitive::None;
    if escapes_scored || reflectance >= 1.0 || draws.uniform() < reflectance {
        walk.direction = flip(walk.direction);
        return reflectance > 0.0;
    }
    let Some(direction) = boundary.refract_into_air(walk.direction) else {
        return false;
    };
    walk.direction = direction;
    walk.in_air = true;
    walk.spectral.scale_all(boundary.index * boundary.index);
    true
}

/// One segment in the air above the water. False when the walk ends.
fn air_segment(
    scene: &Prepared,
    max_events: usize,
    walk: &mut Walk,
    draws: &mut Draws,
    scores: &mut Scores,
) -> bool {
    let Some(boundary) = scene.boundary else {
        return false;
    };
    let down = -walk.direction.z;
    let to_water = if down > 0.0 {
        (walk.origin.z - boundary.height).max(0.0) / down
    } else {
        f64::INFINITY
    };
    if let Some(hit) = scene
        .geometry
        .closest(walk.origin, walk.direction, to_water, walk.from)
    {
        let point = scene.geometry.surface_point(&hit, walk.direction);
        walk.go(hit.t);
        walk.from = hit.primitive;
        return meet_surface(scene, &point, max_events, false, walk, draws, scores);
    }
    if down <= 0.0 {
        walk.score(scores, walk.way(), scene.sky);
        return false;
    }
    walk.go(to_water);
    walk.origin.z = boundary.height;
    walk.from = Primitive::None;
    if draws.uniform() < boundary.external_reflectance(down) {
        walk.direction = flip(walk.direction);
    } else {
        enter_water(&boundary, walk);
    }
    true
}

fn enter_water(boundary: &Boundary, walk: &mut Walk) {
    walk.direction = boundary.refract_into_water(walk.direction);
    walk.in_air = false;
    walk.spectral
        .scale_all(1.0 / (boundary.index * boundary.index));
}

/// Russian roulette by the weight and by how much daylight is left at the walk's depth.
fn survives(scene: &Prepared, start_z: f64, walk: &mut Walk, draws: &mut Draws) -> bool {
    let weight = walk.spectral.largest_weight();
    let descent = (start_z - walk.origin.z).max(0.0);
    let importance = weight
        * scene
            .medium
            .as_ref()
            .map_or(1.0, |m| (-decay(m) * descent).exp());
    // Nothing else ends a path between lossless surfaces in lossless water.
    let patience = if walk.events > SURE_EVENTS {
        LATE_SURVIVAL
    } else {
        1.0
    };
    let survival = (importance / ROULETTE_BELOW).min(patience);
    if survival >= 1.0 {
        return true;
    }
    if !(survival > 0.0) || draws.uniform() >= survival {
        return false;
    }
    walk.spectral.scale_all(1.0 / survival);
    true
}

/// Least rate at which daylight decays with depth over the channels, 1/m: diffusion estimate
/// sqrt(3 a (a + b (1 − g))) bounded by c; it only guides the roulette.
fn decay(medium: &Medium) -> f64 {
    (0..3)
        .map(|k| {
            let a = medium.c[k] - medium.b[k];
            (3.0 * a * (a + medium.b[k] * (1.0 - medium.mean_cosine)))
                .sqrt()
                .min(medium.c[k])
        })
        .fold(f64::INFINITY, f64::min)
}
