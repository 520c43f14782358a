//! Joining a vertex to a lamp or to its mirror image in the water surface.

use std::ops::RangeInclusive;

use glam::DVec3;

use super::{
    bridge::Bridge,
    camera_ray::CameraRay,
    lamp_walk::Walk,
    order::{MAX_ORDER, OrderLaw},
    unfold::{flip, segment_factor},
    ways::Trail,
};
use crate::{
    integrator::sampling::Draws,
    prepare::{Medium, Prepared, Primitive},
};

/// Most lamps that one walk is joined to.
const MOST_LAMPS: usize = 4;
/// Share of the choices of lamps that is even.
const EVEN_SHARE: f64 = 0.1;
/// Distance of a lamp, by those that it is the difference of, below which it is of no account.
const LEAST_DISTANCE: f64 = 1e-6;

/// A lamp as paths are joined to it: itself or its mirror image in the water surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    pub(crate) lamp: usize,
    pub(crate) mirrored: bool,
    /// Reciprocal of the probability of having chosen between lamp and image.
    pub(crate) weight: f64,
}

/// Buffers and tables of one worker.
#[derive(Clone, Debug)]
pub struct LampWorkspace {
    pub(crate) law: OrderLaw,
    pub(crate) bridge: Bridge,
    pub(crate) trail: Trail,
    pub(crate) crossings: Vec<f64>,
    pub(crate) targets: Vec<Target>,
    /// Number of path vertices made so far, for the statistics.
    pub vertices: u64,
}

impl LampWorkspace {
    /// Buffers for walks in `medium`.
    pub(crate) fn new(medium: Option<&Medium>) -> Self {
        let albedo = medium.map_or(0.0, Medium::largest_albedo);
        Self {
            law: OrderLaw::new(albedo),
            bridge: Bridge::default(),
            trail: Trail::default(),
            crossings: Vec::new(),
            targets: Vec::new(),
            vertices: 0,
        }
    }
}

impl Target {
    /// Centre of the lamp or of its image, m.
    pub(super) fn centre(&self, scene: &Prepared) -> DVec3 {
        let position = scene.lamps[self.lamp].position;
        if self.mirrored {
            scene.mirror(position)
        } else {
            position
        }
    }
}

/// Chooses, once per walk, the lamps it is joined to: all of them where there are few, else [`MOST_LAMPS`] by an
/// estimate of what they bring to the camera ray; and for each whether to aim at the lamp or at its mirror image, for the
/// first one by the number `first` in [0, 1) where there is one.
pub(super) fn choose_targets(
    scene: &Prepared,
    active: &[usize],
    ray: &CameraRay,
    mut first: Option<f64>,
    draws: &mut Draws,
    targets: &mut Vec<Target>,
) {
    targets.clear();
    if active.len() <= MOST_LAMPS {
        for &lamp in active {
            targets.push(aim(scene, lamp, 1.0, first.take(), draws));
        }
        return;
    }
    let estimates: Vec<f64> = active.iter().map(|&i| estimate(scene, i, ray)).collect();
    let total: f64 = estimates.iter().sum();
    let share = |e: f64| {
        let guided = if total > 0.0 { e / total } else { 0.0 };
        EVEN_SHARE / active.len() as f64 + (1.0 - EVEN_SHARE) * guided
    };
    let all: f64 = estimates.iter().map(|&e| share(e)).sum();
    // One shift for all choices: a lamp with a share above 1 / MOST_LAMPS is always among them.
    let mut next = draws.uniform();
    let mut sum = 0.0;
    for (&lamp, &e) in active.iter().zip(&estimates) {
        let expected = MOST_LAMPS as f64 * share(e) / all;
        sum += expected;
        let mut chosen = 0.0;
        while next < sum {
            chosen += 1.0;
            next += 1.0;
        }
        if chosen > 0.0 {
            targets.push(aim(scene, lamp, chosen / expected, first.take(), draws));
        }
    }
}

/// What a lamp can bring to a camera ray: its irradiance at the end of the ray, or one free path into the water, or, where
/// nothing ends or dims the ray, where it is closest to the lamp.
fn estimate(scene: &Prepared, lamp: usize, ray: &CameraRay) -> f64 {
    let lamp = &scene.lamps[lamp];
    let c = scene.medium.as_ref().map_or(0.0, |m| m.c_min);
    let (origin, direction, length) = ray.in_water.map_or((ray.origin, ray.direction, 0.0), |s| {
        (s.origin, s.direction, s.length)
    });
    let from_origin = origin - lamp.position;
    let mut reach = length.min(1.0 / c);
    if reach == f64::INFINITY {
        reach = (-from_origin.dot(direction)).max(0.0);
    }
    let offset = from_origin + reach * direction;
    let least2 = LEAST_DISTANCE.powi(2) * (from_origin.length_squared() + reach * reach);
    let distance2 = offset.length_squared().max(lamp.radius.powi(2)).max(least2);
    if distance2 == 0.0 {
        return 0.0;
    }
    let beam = lamp.relative_intensity(offset.normalize_or_zero());
    let largest = lamp.intensity.iter().copied().fold(0.0, f64::max);
    largest * (0.1 + beam) * (-c * distance2.sqrt()).exp() / distance2
}

/// The lamp or its mirror image, by `number` or a new one; `weight` is the reciprocal of the probability of the lamp.
fn aim(
    scene: &Prepared,
    lamp: usize,
    weight: f64,
    number: Option<f64>,
    draws: &mut Draws,
) -> Target {
    let share = scene.lamps[lamp].mirror_share;
    let mirrored = share > 0.0 && number.unwrap_or_else(|| draws.uniform()) < share;
    let probability = if mirrored { share } else { 1.0 - share };
    Target {
        lamp,
        mirrored,
        weight: weight / probability,
    }
}

/// Draws a lamp point and a bridge to it; `None` when its order is not in `orders` or it cannot be made. `orders` starts
/// at 0 or 1.
pub(super) fn draw_bridge(
    scene: &Prepared,
    position: DVec3,
    target: Target,
    walk: &Walk,
    orders: RangeInclusive<usize>,
    u: f64,
    draws: &mut Draws,
    work: &mut LampWorkspace,
) -> Option<DVec3> {
    let Some(medium) = scene.medium.as_ref().filter(|m| m.scatters()) else {
        let end = lamp_point(scene, target, draws);
        let made = orders.contains(&0) && straight(position, end, &mut work.bridge);
        return made.then_some(end);
    };
    let end = lamp_point(scene, target, draws);
    let sigma = medium.by_scattering.sigma[walk.spectral.chosen];
    let depth = sigma * position.distance(end);
    let order = if *orders.start() == 0 {
        work.law.sample(depth, u)?
    } else {
        work.law.sample_scattered(depth, u)?
    };
    if order > MAX_ORDER || !orders.contains(&order) {
        return None;
    }
    work.vertices += order as u64;
    work.bridge
        .draw(position, end, order, &medium.phase, medium.c_min, draws)
        .then_some(end)
}

/// A point of the lamp or of its mirror image, m, in unfolded space.
pub(super) fn lamp_point(scene: &Prepared, target: Target, draws: &mut Draws) -> DVec3 {
    let lamp = &scene.lamps[target.lamp];
    let real = if lamp.radius == 0.0 {
        lamp.position
    } else {
        lamp.sample_point(draws.uniform(), draws.uniform())
    };
    if target.mirrored {
        scene.mirror(real)
    } else {
        real
    }
}

/// The bridge without scattering.
pub(super) fn straight(start: DVec3, end: DVec3, bridge: &mut Bridge) -> bool {
    let distance = start.distance(end);
    if !(distance > 0.0) {
        return false;
    }
    bridge.order = 0;
    bridge.distance = distance;
    bridge.length = distance;
    bridge.first = (end - start) / distance;
    bridge.emission = -bridge.first;
    bridge.vertices.clear();
    bridge.lengths.clear();
    bridge.lengths.push(distance);
    bridge.sin2.clear();
    true
}

/// Relative intensity with which the target sends light along `emission`, a direction of unfolded space.
#[inline]
pub(super) fn emitted(scene: &Prepared, target: Target, emission: DVec3) -> f64 {
    let emission = if target.mirrored {
        flip(emission)
    } else {
        emission
    };
    scene.lamps[target.lamp].relative_intensity(emission)
}

/// Area of the target as the bridge's last segment sees it, where a walk can meet it by chance: 0 for points and
/// across the water surface.
pub(super) fn facing_area(
    scene: &Prepared,
    target: Target,
    start: DVec3,
    end: DVec3,
    bridge: &Bridge,
) -> f64 {
    let lamp = &scene.lamps[target.lamp];
    let last = bridge.vertices.last().copied().unwrap_or(start);
    if lamp.radius == 0.0 || !scene.same_side(last, end) {
        return 0.0;
    }
    let emission = if target.mirrored {
        flip(bridge.emission)
    } else {
        bridge.emission
    };
    lamp.facing_area(emission)
}

/// Walks along the bridge; false where it is blocked. Fills the reflectances met per segment.
pub(super) fn cross(
    scene: &Prepared,
    start: DVec3,
    end: DVec3,
    from: Primitive,
    work: &mut LampWorkspace,
) -> bool {
    work.crossings.clear();
    let mut previous = start;
    let mut primitive = from;
    for i in 0..=work.bridge.order {
        let next = work.bridge.vertices.get(i).copied().unwrap_or(end);
        let factor = segment_factor(scene, previous, next, primitive);
        if factor == 0.0 {
            return false;
        }
        work.crossings.push(factor);
        previous = next;
        primitive = Primitive::None;
    }
    true
}
