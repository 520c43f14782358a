//! Joining the last vertex of a walk to the lamps, by bridges and by what lies straight ahead.

use std::f64::consts::PI;

use glam::DVec3;

use super::{
    lamp_target::{LampWorkspace, Target, cross, draw_bridge, emitted, facing_area, straight},
    lamp_walk::Walk,
    score::{Scores, Source, Way},
    ways::{self, Junction},
};
use crate::{
    integrator::sampling::{Draws, directions::sin2_half},
    prepare::{Medium, Prepared, SurfacePoint},
};

/// Where the walk stands.
pub(super) enum Site<'a> {
    /// In the water.
    Volume(&'a Medium),
    /// On a surface.
    Surface(&'a SurfacePoint),
}

impl Site<'_> {
    /// Scattering function towards the real unit direction `towards` for a walk that arrived along `arrived`, 1/sr:
    /// the phase function, or cosine/π.
    pub(super) fn lobe(&self, arrived: DVec3, towards: DVec3) -> f64 {
        match self {
            Self::Volume(medium) => medium.phase.value(sin2_half(arrived, towards)),
            Self::Surface(point) if point.normal.dot(towards) <= 0.0 => 0.0,
            Self::Surface(point) => point.shading_normal.dot(towards).max(0.0) / PI,
        }
    }
}

/// Bridges from the walk's last vertex to every target. The first of a walk takes its order from the leading numbers.
pub(super) fn join(
    scene: &Prepared,
    site: &Site,
    max_events: usize,
    leading: bool,
    walk: &Walk,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    let position = walk.unfolded(scene, walk.origin);
    // The straight way from the first surface is not the walk's to count.
    let least_order = usize::from(walk.unscattered && walk.met_surface);
    for i in 0..work.targets.len() {
        let target = work.targets[i];
        let u = if leading && i == 0 {
            draws.leading(5)
        } else {
            draws.uniform()
        };
        let orders = least_order..=max_events.saturating_sub(walk.events);
        let Some(lamp) = draw_bridge(scene, position, target, walk, orders, u, draws, work) else {
            continue;
        };
        let Some(factor) = turn_bridge(scene, site, target, position, lamp, walk, draws, work)
        else {
            continue;
        };
        let towards = walk.unfolded_direction(work.bridge.first);
        let lobe = site.lobe(walk.direction, towards);
        if lobe > 0.0 {
            send(
                scene, target, position, lamp, lobe, factor, walk, work, scores,
            );
        }
    }
}

/// Chooses the roll of a bridge that scatters by what is known before it is followed: the lamp's beam and, at a surface,
/// the cosine. Phase functions of junctions in the water are left to the ways. Returns the factor for the choice.
fn turn_bridge(
    scene: &Prepared,
    site: &Site,
    target: Target,
    start: DVec3,
    end: DVec3,
    walk: &Walk,
    draws: &mut Draws,
    work: &mut LampWorkspace,
) -> Option<f64> {
    let on_surface = matches!(site, Site::Surface(_));
    if work.bridge.order == 0 || !(on_surface || scene.lamps[target.lamp].is_directed()) {
        return Some(1.0);
    }
    let axis = (end - start) / work.bridge.distance;
    work.bridge
        .choose_roll(start, axis, draws.uniform(), |first, emission| {
            let lobe = if on_surface {
                site.lobe(walk.direction, walk.unfolded_direction(first))
            } else {
                1.0
            };
            lobe * emitted(scene, target, emission)
        })
}

/// Disk lamps that the walk's new direction meets: one more way of making the path, without which a lamp in view, or
/// one close to a surface, would bring unbounded weights.
pub(super) fn meet_lamps(
    scene: &Prepared,
    walk: &Walk,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    let Some(lobe) = work.trail.vertices.last().map(|v| v.lobe) else {
        return;
    };
    if walk.unscattered {
        return;
    }
    for i in 0..work.targets.len() {
        let target = work.targets[i];
        if let Some((start, end)) = lamp_ahead(scene, target, walk, work) {
            send(scene, target, start, end, lobe, 1.0, walk, work, scores);
        }
    }
}

/// Adds the light of the path that the workspace's bridge makes from `start` to the lamp point `lamp`, times `factor`.
fn send(
    scene: &Prepared,
    target: Target,
    start: DVec3,
    lamp: DVec3,
    lobe: f64,
    factor: f64,
    walk: &Walk,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    let relative = emitted(scene, target, work.bridge.emission);
    if relative == 0.0 || !cross(scene, start, lamp, walk.from, work) {
        return;
    }
    let facing = facing_area(scene, target, start, lamp, &work.bridge);
    let junction = Junction { lobe, lamp, facing };
    let radiance = ways::contribution(scene.medium.as_ref(), &walk.spectral, work, &junction);
    let intensity = scene.lamps[target.lamp].intensity;
    let factor = factor * relative * target.weight;
    let way = Way::of(walk.met_surface, walk.scatterings + work.bridge.order > 0);
    let light = std::array::from_fn(|k| factor * intensity[k] * radiance[k]);
    scores.add(Source::Lamp(target.lamp), way, light);
}

/// Start and end, unfolded, of the straight way to the target's disk when the walk's direction meets it; the bridge
/// of the workspace is then this way.
fn lamp_ahead(
    scene: &Prepared,
    target: Target,
    walk: &Walk,
    work: &mut LampWorkspace,
) -> Option<(DVec3, DVec3)> {
    let lamp = &scene.lamps[target.lamp];
    if lamp.radius == 0.0 || target.mirrored != walk.mirrored {
        return None;
    }
    let to_boundary = scene.distance_to_boundary(walk.origin, walk.direction);
    let (t, _) = lamp.radiance_along(walk.origin, walk.direction, to_boundary)?;
    let start = walk.unfolded(scene, walk.origin);
    let end = walk.unfolded(scene, walk.origin + t * walk.direction);
    straight(start, end, &mut work.bridge).then_some((start, end))
}
