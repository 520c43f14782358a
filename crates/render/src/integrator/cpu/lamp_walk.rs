//! How a camera walk that looks for lamp light moves: segments, the water surface, roulette.

use glam::DVec3;

use super::{
    LATE_SURVIVAL, SURE_EVENTS,
    camera_ray::{CameraRay, End, Segment},
    equiangular::Equiangular,
    lamp_target::Target,
    spectral::Spectral,
    unfold::flip,
    ways::Vertex,
};
use crate::{
    integrator::sampling::Draws,
    prepare::{Medium, Prepared, Primitive, Strategies},
};

/// Volume vertices before which a walk that has met no surface is ended only far from where it has been.
pub(super) const SURE_VERTICES: usize = 12;

/// Roulette sets in where the prospects of a walk fall below the reciprocals of these.
const REACH_IN_WATER: f64 = 3.0;
const REACH_FROM_SURFACE: f64 = 5.0;
/// Roulette of a walk that has met no surface sets in where its prospects fall by this factor below their best.
const FALL: f64 = 10.0;
/// Within these shares of three lengths of the scene around a lamp a walk is taken to be as close as it gets: of the
/// lamp's distance from where the camera ray begins, of that from where it ends on a surface that is in sight, and of
/// the ray itself up to one free path.
const OF_START: f64 = 3.0;
const OF_END: f64 = 0.5;
const OF_RAY: f64 = 0.02;

/// How the first segment of a walk ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FirstSegment {
    /// As the free flight falls.
    Free,
    /// Unscattered at the end of the camera ray, for certain.
    Through,
    /// In a scattering before the end of the camera ray, for certain.
    Scattered,
}

/// The state of a walk, in real space; `mirrored` tells whether it has reflected an odd number of times.
#[derive(Clone, Copy)]
pub(crate) struct Walk {
    pub(crate) origin: DVec3,
    pub(super) direction: DVec3,
    pub(super) from: Primitive,
    pub(crate) mirrored: bool,
    /// Length since the water was entered, m.
    pub(super) length: f64,
    /// Product of the surface reflectances met so far.
    pub(super) reflected: f64,
    pub(super) scatterings: usize,
    pub(super) events: usize,
    pub(crate) met_surface: bool,
    /// Whether nothing has happened since the camera but that the first surface was met.
    pub(crate) unscattered: bool,
    pub(crate) spectral: Spectral,
    /// Largest prospects so far, before a surface is met.
    pub(crate) best: f64,
    /// Square of the distance from a lamp, m², beyond which prospects fall: [`lit_length2`].
    pub(crate) lit_length2: f64,
}

impl Walk {
    /// At the start of the camera ray's part in the water; `lit_length2` as in the field.
    pub(crate) fn start(segment: Segment, lit_length2: f64) -> Self {
        Self {
            origin: segment.origin,
            direction: segment.direction,
            from: Primitive::None,
            mirrored: false,
            length: 0.0,
            reflected: 1.0,
            scatterings: 0,
            events: 0,
            met_surface: false,
            unscattered: true,
            spectral: Spectral::start(&Strategies::default(), 0.5),
            best: 0.0,
            lit_length2,
        }
    }

    /// Its first surface: what comes after is judged by the lamp's distance from there.
    pub(crate) fn land(&mut self, scene: &Prepared, active: &[usize]) {
        let landed = OF_END * OF_END * nearest2(scene, active, self.origin);
        self.lit_length2 = self.lit_length2.max(landed);
    }

    /// A real point or direction in the unfolded space of the walk.
    pub(super) fn unfolded(&self, scene: &Prepared, point: DVec3) -> DVec3 {
        if self.mirrored {
            scene.mirror(point)
        } else {
            point
        }
    }

    /// The place where the walk stands.
    pub(super) fn vertex(&self, scene: &Prepared) -> Vertex {
        Vertex {
            position: self.unfolded(scene, self.origin),
            length: self.length,
            lobe: 0.0,
            reflected: self.reflected,
        }
    }

    /// Goes on to a scattering; its effect on the weights is left out.
    pub(super) fn go_to_scattering(&mut self, t: f64) {
        self.origin += t * self.direction;
        self.from = Primitive::None;
        self.length += t;
        self.scatterings += 1;
        self.events += 1;
        self.unscattered = false;
    }

    /// Goes on to a surface.
    pub(super) fn reach(&mut self, t: f64, primitive: Primitive) {
        self.origin += t * self.direction;
        self.from = primitive;
    }

    pub(super) fn unfolded_direction(&self, direction: DVec3) -> DVec3 {
        if self.mirrored {
            flip(direction)
        } else {
            direction
        }
    }
}

/// The end of the camera ray's first segment in water and its effect on the weights.
pub(super) fn first_end(
    scene: &Prepared,
    ray: &CameraRay,
    kind: FirstSegment,
    targets: &[Target],
    walk: &mut Walk,
    u: f64,
) -> End {
    let (Some(medium), Some(start)) = (&scene.medium, ray.in_water) else {
        return ray.end();
    };
    if kind == FirstSegment::Through || !medium.scatters() {
        walk.spectral.pass_surely(medium, start.length);
        walk.length += start.length;
        return ray.end();
    }
    let strategies = &medium.by_scattering;
    let within = strategies.sigma.map(|s| -(-s * start.length).exp_m1());
    let mut u = u;
    if kind == FirstSegment::Free {
        let chance = within[walk.spectral.chosen];
        if u >= chance {
            walk.spectral.pass(medium, strategies, start.length);
            walk.length += start.length;
            return ray.end();
        }
        u /= chance;
    }
    let t = scattered_at(scene, medium, start, within, u, targets, walk);
    if kind == FirstSegment::Scattered {
        for j in 0..walk.spectral.count {
            walk.spectral.density[j] /= within[j].max(f64::MIN_POSITIVE);
        }
    }
    End::Scatter(t)
}

/// Distance to a scattering on the segment: as a free flight falls, or evenly over the angle under which a lamp sees
/// it. Multiplies the strategies' densities by what they differ from those of the free flight.
fn scattered_at(
    scene: &Prepared,
    medium: &Medium,
    start: Segment,
    within: [f64; 3],
    u: f64,
    targets: &[Target],
    walk: &mut Walk,
) -> f64 {
    let strategies = &medium.by_scattering;
    let (count, chosen) = (walk.spectral.count, walk.spectral.chosen);
    let density = (0..count).map(|j| strategies.sigma[j] / within[j]);
    let density = density.sum::<f64>() / count as f64;
    let beside = |target: &Target| {
        let (law, share) = Equiangular::beside(scene, *target, &start, density);
        (law, share / targets.len() as f64)
    };
    let (mut left, mut others, mut even) = (u, 1.0, None);
    for (law, share) in targets.iter().map(beside) {
        if even.is_none() && left < share {
            even = Some(law.sample(left / share));
        }
        left -= share;
        others -= share;
    }
    let t = even.unwrap_or_else(|| {
        let u = (left / others).clamp(0.0, 1.0);
        (-(-u * within[chosen]).ln_1p() / strategies.sigma[chosen]).min(start.length)
    });
    if others < 1.0 {
        let laws = targets.iter().map(beside);
        let even: f64 = laws.map(|(law, share)| share * law.density(t)).sum();
        for j in 0..count {
            let sigma = strategies.sigma[j];
            // Where the exponential would overflow no light is left.
            let relative = even * within[j] / sigma * (sigma * t).min(600.0).exp();
            walk.spectral.density[j] *= others + relative;
        }
    }
    t
}

/// Length of a free flight drawn with the walk's strategy from `u`; infinite without scattering.
#[inline]
fn flight(scene: &Prepared, walk: &Walk, u: f64) -> f64 {
    match &scene.medium {
        Some(m) if m.scatters() => -u.ln() / m.by_scattering.sigma[walk.spectral.chosen],
        _ => f64::INFINITY,
    }
}

/// Draws a free flight and finds what ends the segment; passes the weights where nothing scattered.
pub(super) fn next_end(scene: &Prepared, walk: &mut Walk, u: f64) -> End {
    let end = free_end(scene, walk, flight(scene, walk, u));
    if let (Some(medium), false, Some(t)) = (
        &scene.medium,
        matches!(end, End::Scatter(_)),
        end.distance(),
    ) {
        walk.spectral.pass(medium, &medium.by_scattering, t);
        walk.length += t;
    }
    end
}

/// What ends a segment on which the walk would scatter after `t`.
pub(super) fn free_end(scene: &Prepared, walk: &Walk, t: f64) -> End {
    let to_boundary = scene.distance_to_boundary(walk.origin, walk.direction);
    let reach = t.min(to_boundary);
    match scene
        .geometry
        .closest(walk.origin, walk.direction, reach, walk.from)
    {
        Some(hit) => End::Surface(
            hit.t,
            scene.geometry.surface_point(&hit, walk.direction),
            hit.primitive,
        ),
        None if t < to_boundary => End::Scatter(t),
        None if to_boundary < f64::INFINITY => End::Boundary(to_boundary),
        None => End::Nothing,
    }
}

/// The underside of the water surface: reflected with its reflectance as the probability.
pub(super) fn reflect_at_boundary(
    scene: &Prepared,
    t: f64,
    walk: &mut Walk,
    draws: &mut Draws,
) -> bool {
    let Some(boundary) = scene.boundary else {
        return false;
    };
    let reflectance = boundary.internal_reflectance(walk.direction.z);
    // Lamp light does not come back from the air, so what is transmitted ends here.
    if reflectance < 1.0 && draws.uniform() >= reflectance {
        return false;
    }
    walk.origin += t * walk.direction;
    walk.origin.z = boundary.height;
    walk.direction = flip(walk.direction);
    walk.from = Primitive::None;
    walk.mirrored = !walk.mirrored;
    walk.unscattered = false;
    walk.reflected *= reflectance;
    true
}

/// Russian roulette by what the walk can still bring.
pub(super) fn survives(
    scene: &Prepared,
    active: &[usize],
    walk: &mut Walk,
    draws: &mut Draws,
) -> bool {
    let weight = walk.spectral.largest_weight();
    let survival = if walk.met_surface {
        survival(scene, active, walk, weight)
    } else {
        survival_in_veil(scene, active, walk, weight)
    };
    if survival >= 1.0 {
        return true;
    }
    if !(survival > 0.0) || draws.uniform() >= survival {
        return false;
    }
    walk.spectral.scale_all(1.0 / survival);
    true
}

/// Probability with which a walk of this weight that has met no surface goes on; 1 or more: for certain. Where free
/// flights are long it leaves the lamps behind, and what it brings from there is little beside what it has brought: as
/// far as its prospects tell, its square with the weight 1 / survival is at most 1 / `FALL`² of that.
pub(crate) fn survival_in_veil(
    scene: &Prepared,
    active: &[usize],
    walk: &mut Walk,
    weight: f64,
) -> f64 {
    let prospects = prospects(scene, active, walk, weight);
    walk.best = walk.best.max(prospects);
    let beside_best = FALL * prospects / walk.best;
    if walk.scatterings <= SURE_VERTICES {
        beside_best
    } else {
        beside_best.min(at_most_patience(walk, REACH_IN_WATER * prospects))
    }
}

/// Probability with which a walk of this weight goes on after a surface or many scatterings; 1 or more: for certain.
pub(crate) fn survival(scene: &Prepared, active: &[usize], walk: &Walk, weight: f64) -> f64 {
    let reach = if walk.met_surface {
        REACH_FROM_SURFACE
    } else {
        REACH_IN_WATER
    };
    at_most_patience(walk, reach * prospects(scene, active, walk, weight))
}

fn at_most_patience(walk: &Walk, importance: f64) -> f64 {
    let patience = if walk.events > SURE_EVENTS {
        LATE_SURVIVAL
    } else {
        1.0
    };
    importance.min(patience)
}

/// Estimate of what a walk of this weight can still bring, relative to what one of weight 1 brings from close to a lamp.
fn prospects(scene: &Prepared, active: &[usize], walk: &Walk, weight: f64) -> f64 {
    let nearest2 = nearest2(scene, active, walk.origin);
    weight * (-0.5 * c_min(scene) * nearest2.sqrt()).exp() / (1.0 + nearest2 / walk.lit_length2)
}

/// Square of the distance from the nearest lamp, m², within which a walk along `ray` is close to it: a length of the
/// scene, so that walks end alike whatever the unit. Greater than 0; infinite where nothing ends or dims the ray.
pub(crate) fn lit_length2(scene: &Prepared, active: &[usize], ray: &CameraRay) -> f64 {
    let Some(segment) = ray.in_water else {
        return f64::INFINITY;
    };
    let c = c_min(scene);
    let of_ray = OF_RAY * segment.length.min(1.0 / c);
    let near = OF_START * OF_START * nearest2(scene, active, segment.origin) + of_ray * of_ray;
    if !ray.ends_on_surface() {
        return near;
    }
    let end = segment.origin + segment.length * segment.direction;
    let of_end2 = OF_END * OF_END * nearest2(scene, active, end);
    near + of_end2 * (-4.0 * c * of_end2.sqrt()).exp()
}

/// Square of the distance of `point` from the nearest lamp, m².
fn nearest2(scene: &Prepared, active: &[usize], point: DVec3) -> f64 {
    active
        .iter()
        .map(|&i| scene.lamps[i].position.distance_squared(point))
        .fold(f64::INFINITY, f64::min)
}

fn c_min(scene: &Prepared) -> f64 {
    scene.medium.as_ref().map_or(0.0, |m| m.c_min)
}
