//! Light of the lamps: a camera walk whose vertices are joined to the lamps by bridges.
//!
//! The last surface vertex before the lamp decides who counts a path: every surface hit of the walk makes a
//! bridge; volume vertices do so only before the first surface hit (the veil) and after one close to a lamp.
//! Which surface point a pixel's walk goes on from is chosen among several ([`super::lamp_landing`]).

use std::f64::consts::PI;

use glam::DVec3;

use super::{
    camera_ray::{CameraRay, End},
    lamp_join::{Site, join, meet_lamps},
    lamp_landing::{Landing, Scouts},
    lamp_target::{LampWorkspace, choose_targets},
    lamp_walk::{
        FirstSegment, Walk, first_end, lit_length2, next_end, reflect_at_boundary, survives,
    },
    score::Scores,
    spectral::Spectral,
};
use crate::{
    integrator::sampling::{
        Draws,
        directions::{cosine_hemisphere, turn},
    },
    prepare::{Prepared, SurfacePoint},
};

/// Distance of a surface from a lamp, in optical depths, below which the water between them is joined to the lamp too.
const CLOSE: f64 = 0.6;

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
    let lit_length2 = lit_length2(scene, active, ray);
    let mut walk = Walk::start(start, lit_length2);
    let chooser = draws.leading(6);
    walk.spectral = Spectral::start(&strategies, chooser);
    let aim = Some(walk.spectral.rest_of_start(chooser));
    walk.spectral.scale_all(ray.entry_factor);
    work.trail.start();
    choose_targets(scene, active, ray, aim, draws, &mut work.targets);
    let landed = to_first_surface(
        scene, active, ray, first, max_events, &mut walk, draws, work, scores,
    );
    let scouts = Scouts {
        scene,
        active,
        ray,
        first,
        max_events,
        lit_length2,
    };
    let landing = landed.map(|point| Landing { walk, point });
    let Some(Landing { mut walk, point }) = scouts.choose(landing, draws, work) else {
        return;
    };
    walk.land(scene, active);
    if !meet_surface(scene, &point, max_events, &mut walk, draws, work, scores)
        || !survives(scene, active, &mut walk, draws)
    {
        return;
    }
    while walk.events < max_events {
        let end = next_end(scene, &mut walk, draws.uniform());
        work.vertices += 1;
        let alive = match end {
            End::Scatter(t) => scatter(scene, t, max_events, &mut walk, draws, work, scores),
            End::Surface(t, point, primitive) => {
                walk.reach(t, primitive);
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

/// Follows the walk to the first surface, with bridges from where it scatters; `None` where it ends before.
fn to_first_surface(
    scene: &Prepared,
    active: &[usize],
    ray: &CameraRay,
    first: FirstSegment,
    max_events: usize,
    walk: &mut Walk,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) -> Option<SurfacePoint> {
    let mut segment = Some(first);
    while walk.events < max_events {
        let end = match segment.take() {
            Some(kind) => {
                let u = draws.leading(2);
                first_end(scene, ray, kind, &work.targets, walk, u)
            }
            None => next_end(scene, walk, draws.uniform()),
        };
        work.vertices += 1;
        let alive = match end {
            End::Scatter(t) => scatter(scene, t, max_events, walk, draws, work, scores),
            End::Surface(t, point, primitive) => {
                walk.reach(t, primitive);
                return Some(point);
            }
            End::Boundary(t) => reflect_at_boundary(scene, t, walk, draws),
            End::Nothing => false,
        };
        if !alive || !survives(scene, active, walk, draws) {
            return None;
        }
    }
    None
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
    walk.go_to_scattering(t);
    walk.spectral.scatter(medium, &medium.by_scattering, t);
    let leading = walk.scatterings == 1 && walk.events == 1;
    let joined = !walk.met_surface || work.trail.companions;
    if joined {
        work.trail.vertices.push(walk.vertex(scene));
        let site = Site::Volume(medium);
        join(scene, &site, max_events, leading, walk, draws, work, scores);
    }
    let (u, v) = direction_numbers(leading, draws);
    let x = medium.phase.sample_x(u);
    walk.direction = turn(walk.direction, x, v);
    if joined {
        work.trail.leave(medium.phase.value(x));
        meet_lamps(scene, walk, work, scores);
    }
    true
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
    walk.unscattered &= leading;
    walk.events += 1;
    walk.met_surface = true;
    walk.spectral.scale(point.reflectance);
    if walk.spectral.value == [0.0; 3] {
        return false;
    }
    let vertex = walk.vertex(scene);
    let close = close_to_lamp(scene, vertex.position, work);
    work.trail.root(vertex, close, walk.unscattered);
    let site = Site::Surface(point);
    join(scene, &site, max_events, leading, walk, draws, work, scores);
    let (u, v) = direction_numbers(leading, draws);
    walk.direction = cosine_hemisphere(point.shading_normal, u, v);
    if walk.direction.dot(point.normal) <= 0.0 {
        return false;
    }
    let cosine = point.shading_normal.dot(walk.direction);
    work.trail.leave(cosine / PI);
    meet_lamps(scene, walk, work, scores);
    walk.unscattered = false;
    true
}

/// Whether a lamp is so close to a surface point, in free paths, that bridges alone, which scale with the distance,
/// would have a heavy tail there.
fn close_to_lamp(scene: &Prepared, position: DVec3, work: &LampWorkspace) -> bool {
    let Some(medium) = scene.medium.as_ref().filter(|m| m.scatters()) else {
        return false;
    };
    work.targets.iter().any(|target| {
        let lamp = &scene.lamps[target.lamp];
        let distance = target.centre(scene).distance(position) - lamp.radius;
        distance * medium.c_max < CLOSE
    })
}

fn direction_numbers(leading: bool, draws: &mut Draws) -> (f64, f64) {
    if leading {
        (draws.leading(3), draws.leading(4))
    } else {
        (draws.uniform(), draws.uniform())
    }
}
