//! Light of the lamps: a camera walk whose vertices are joined to the lamps by bridges.
//!
//! The last surface vertex before the lamp decides who counts a path: every surface hit of the walk makes a
//! bridge; volume vertices do so only before the first surface hit (the veil).

use std::f64::consts::PI;

use glam::DVec3;

use super::{
    camera_ray::{CameraRay, End},
    lamp_target::{
        LampWorkspace, Target, add, choose_targets, cross, draw_bridge, emitted, facing_area,
        straight, surface_contribution,
    },
    lamp_walk::{FirstSegment, Walk, first_end, next_end, reflect_at_boundary, survives},
    score::{Scores, Way},
    spectral::Spectral,
    veil::{self, Vertex},
};
use crate::{
    integrator::sampling::{
        Draws,
        directions::{cosine_hemisphere, sin2_half, turn},
    },
    prepare::{Medium, Prepared, Primitive, SurfacePoint},
};

/// Traces one walk from `ray` and adds the light of the lamps in `active` to `scores`. `max_events` limits
/// scatterings and reflections.
pub fn trace(
    scene: &Prepared,
    active: &[usize],
    ray: &CameraRay,
    first: FirstSegment,
    max_events: usize,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    let Some(start) = ray.in_water else { return };
    let strategies = scene
        .medium
        .as_ref()
        .map(|m| m.by_scattering)
        .unwrap_or_default();
    let mut spectral = Spectral::start(&strategies, draws.uniform());
    spectral.scale_all(ray.entry_factor);
    let mut walk = Walk {
        origin: start.origin,
        direction: start.direction,
        from: Primitive::None,
        mirrored: false,
        length: 0.0,
        reflected: 1.0,
        scatterings: 0,
        events: 0,
        met_surface: false,
        spectral,
    };
    work.walk.clear();
    choose_targets(scene, active, draws, &mut work.targets);
    let mut segment = Some(first);
    while walk.events < max_events {
        let end = match segment.take() {
            Some(kind) => first_end(scene, ray, kind, &mut walk, draws),
            None => next_end(scene, &mut walk, draws.uniform()),
        };
        work.vertices += 1;
        let alive = match end {
            End::Scatter(t) => scatter(scene, t, max_events, &mut walk, draws, work, scores),
            End::Surface(t, point, primitive) => {
                walk.origin += t * walk.direction;
                walk.from = primitive;
                meet_surface(scene, &point, max_events, &mut walk, draws, work, scores)
            }
            End::Boundary(t) => reflect_at_boundary(scene, t, &mut walk, draws),
            End::Nothing => false,
        };
        if !alive || !survives(scene, active, &mut walk, draws) {
            return;
        }
    }
}

/// A scattering after `t`: bridges if no surface was met, then a new direction.
fn scatter(
    scene: &Prepared,
    t: f64,
    max_events: usize,
    walk: &mut Walk,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) -> bool {
    let Some(medium) = &scene.medium else {
        return false;
    };
    walk.origin += t * walk.direction;
    walk.from = Primitive::None;
    walk.length += t;
    walk.scatterings += 1;
    walk.events += 1;
    walk.spectral.scatter(medium, &medium.by_scattering, t);
    let leading = walk.scatterings == 1 && walk.events == 1;
    if !walk.met_surface {
        work.walk.push(Vertex {
            position: walk.unfolded(scene, walk.origin),
            length: walk.length,
            phase: 0.0,
            reflected: walk.reflected,
        });
        join_volume_vertex(
            scene, medium, max_events, leading, walk, draws, work, scores,
        );
    }
    let (u, v) = if leading {
        (draws.leading(3), draws.leading(4))
    } else {
        (draws.uniform(), draws.uniform())
    };
    let x = medium.phase.sample_x(u);
    walk.direction = turn(walk.direction, x, v);
    if let (false, Some(last)) = (walk.met_surface, work.walk.last_mut()) {
        last.phase = medium.phase.value(x);
        meet_lamps(scene, medium, walk, work, scores);
    }
    true
}

/// Disk lamps on the way after a scattering: one more way of making the veil, without which the light of a lamp
/// in view, scattered by next to nothing close to it, would have an unbounded weight.
fn meet_lamps(
    scene: &Prepared,
    medium: &Medium,
    walk: &Walk,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    for i in 0..work.targets.len() {
        let target = work.targets[i];
        let Some((start, end)) = lamp_ahead(scene, target, walk, work) else {
            continue;
        };
        let intensity = emitted(scene, target, &work.bridge);
        if intensity == 0.0 || !cross(scene, start, end, walk.from, work) {
            continue;
        }
        let facing = facing_area(scene, target, start, end, &work.bridge);
        let junction = work.walk.last().map_or(0.0, |v| v.phase);
        let veil = veil::contribution(
            medium,
            &work.law,
            &walk.spectral,
            &work.walk,
            junction,
            &work.bridge,
            end,
            &work.crossings,
            facing,
        );
        let factor = intensity * target.weight;
        add(scene, target, Way::Backscatter, factor, veil, scores);
    }
}

/// Bridges from the last volume vertex to every target.
fn join_volume_vertex(
    scene: &Prepared,
    medium: &Medium,
    max_events: usize,
    leading: bool,
    walk: &Walk,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    let position = walk.unfolded(scene, walk.origin);
    let direction = walk.unfolded_direction(walk.direction);
    for i in 0..work.targets.len() {
        let target = work.targets[i];
        let u = if leading && i == 0 {
            draws.leading(5)
        } else {
            draws.uniform()
        };
        let Some(lamp_point) =
            draw_bridge(scene, position, target, walk, max_events, u, draws, work)
        else {
            continue;
        };
        let intensity = emitted(scene, target, &work.bridge);
        if intensity == 0.0 || !cross(scene, position, lamp_point, walk.from, work) {
            continue;
        }
        let facing = facing_area(scene, target, position, lamp_point, &work.bridge);
        let veil = veil::contribution(
            medium,
            &work.law,
            &walk.spectral,
            &work.walk,
            medium.phase.value(sin2_half(direction, work.bridge.first)),
            &work.bridge,
            lamp_point,
            &work.crossings,
            facing,
        );
        add(
            scene,
            target,
            Way::Backscatter,
            intensity * target.weight,
            veil,
            scores,
        );
    }
}

/// A surface: bridges to every target, then a new direction.
fn meet_surface(
    scene: &Prepared,
    point: &SurfacePoint,
    max_events: usize,
    walk: &mut Walk,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) -> bool {
    let leading = walk.events == 0;
    walk.events += 1;
    walk.met_surface = true;
    walk.spectral.scale(point.reflectance);
    if walk.spectral.value == [0.0; 3] {
        return false;
    }
    let position = walk.unfolded(scene, walk.origin);
    for i in 0..work.targets.len() {
        let target = work.targets[i];
        let u = if leading && i == 0 {
            draws.leading(5)
        } else {
            draws.uniform()
        };
        let Some(lamp_point) =
            draw_bridge(scene, position, target, walk, max_events, u, draws, work)
        else {
            continue;
        };
        let first = walk.unfolded_direction(work.bridge.first);
        let cosine = point.shading_normal.dot(first);
        if cosine <= 0.0 || point.normal.dot(first) <= 0.0 {
            continue;
        }
        let intensity = emitted(scene, target, &work.bridge);
        if intensity == 0.0 || !cross(scene, position, lamp_point, walk.from, work) {
            continue;
        }
        let reflected: f64 = work.crossings.iter().product();
        let factor = intensity * target.weight * reflected * cosine / PI;
        let chance = if work.bridge.order == 0 {
            let facing = facing_area(scene, target, position, lamp_point, &work.bridge);
            facing * cosine / (PI * work.bridge.distance.powi(2))
        } else {
            0.0
        };
        let radiance = surface_contribution(scene, &walk.spectral, chance, work);
        let way = Way::of(true, walk.scatterings + work.bridge.order > 0);
        add(scene, target, way, factor, radiance, scores);
    }
    let (u, v) = if leading {
        (draws.leading(3), draws.leading(4))
    } else {
        (draws.uniform(), draws.uniform())
    };
    walk.direction = cosine_hemisphere(point.shading_normal, u, v);
    if walk.direction.dot(point.normal) <= 0.0 {
        return false;
    }
    meet_lamps_from_surface(scene, point, walk, work, scores);
    true
}

/// Disk lamps on the way from a surface: with the straight bridge one of two ways of making that path, so that a lamp
/// close to a surface has a bounded weight.
fn meet_lamps_from_surface(
    scene: &Prepared,
    point: &SurfacePoint,
    walk: &Walk,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    for i in 0..work.targets.len() {
        let target = work.targets[i];
        let Some((start, end)) = lamp_ahead(scene, target, walk, work) else {
            continue;
        };
        let intensity = emitted(scene, target, &work.bridge);
        if intensity == 0.0 || !cross(scene, start, end, walk.from, work) {
            continue;
        }
        let cosine = point.shading_normal.dot(walk.direction);
        let facing = facing_area(scene, target, start, end, &work.bridge);
        let chance = facing * cosine / (PI * work.bridge.distance.powi(2));
        let radiance = surface_contribution(scene, &walk.spectral, chance, work);
        let factor = intensity * target.weight * cosine / PI;
        let way = Way::of(true, walk.scatterings > 0);
        add(scene, target, way, factor, radiance, scores);
    }
}

/// Start and end, unfolded, of the straight way to the target's disk when the walk's direction meets it; the bridge
/// of the workspace is then this way.
fn lamp_ahead(
    scene: &Prepared,
    target: Target,
    walk: &Walk,
    work: &mut LampWorkspace,
) -> Option<(DVec3, DVec3)> {
    if target.mirrored != walk.mirrored {
        return None;
    }
    let lamp = &scene.lamps[target.lamp];
    let to_boundary = scene.distance_to_boundary(walk.origin, walk.direction);
    let (t, _) = lamp.radiance_along(walk.origin, walk.direction, to_boundary)?;
    let start = walk.unfolded(scene, walk.origin);
    let end = walk.unfolded(scene, walk.origin + t * walk.direction);
    straight(start, end, &mut work.bridge).then_some((start, end))
}
