//! Light of the lamps that scatters nowhere in the water: lamp, first surface, camera; and lamps that the camera sees.
//!
//! It is smooth but for the texture and the edges in the pixel, and cheap, so that it is sampled at more image points
//! than the walks, which leave it out.

use std::f64::consts::PI;

use super::{
    camera_ray::{CameraRay, End, Segment},
    lamp_join::{Site, lamp_ahead, send},
    lamp_target::{LampWorkspace, choose_targets, lamp_point, straight},
    lamp_walk::Walk,
    score::{Scores, Source, Way},
    spectral::Spectral,
    unfold::flip,
};
use crate::{
    integrator::sampling::{Draws, directions::cosine_hemisphere},
    prepare::{Prepared, Primitive, SurfacePoint},
};

/// Distance from a surface, in radii, below which a lamp's disk is also looked for in a drawn direction: joining a
/// surface to points of a disk close to it has heavy tails.
const LARGE: f64 = 4.0;

/// Adds `share` of the unscattered light of the lamps in `active` along `ray` to `scores`.
pub(super) fn add_direct(
    scene: &Prepared,
    active: &[usize],
    ray: &CameraRay,
    max_events: usize,
    share: f64,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    see_lamps(scene, active, ray, share, scores);
    if max_events == 0 {
        return;
    }
    let (Some(start), End::Surface(t, point, primitive)) = (ray.in_water, ray.end()) else {
        return;
    };
    if point.reflectance == [0.0; 3] {
        return;
    }
    let mut spectral = Spectral::start(&Default::default(), 0.5);
    spectral.scale(point.reflectance);
    spectral.scale_all(ray.entry_factor * share);
    if let Some(medium) = &scene.medium {
        spectral.pass_surely(medium, t);
    }
    let mut walk = Walk {
        origin: start.origin + t * start.direction,
        direction: start.direction,
        from: primitive,
        length: t,
        events: 1,
        met_surface: true,
        spectral,
        ..Walk::start(start)
    };
    choose_targets(scene, active, ray, draws, &mut work.targets);
    work.trail.straight(walk.vertex(scene));
    join_straight(scene, &point, &walk, draws, work, scores);
    if work.targets.iter().any(|t| is_large(scene, t.lamp, &walk)) {
        let (u, v) = (draws.uniform(), draws.uniform());
        walk.direction = cosine_hemisphere(point.shading_normal, u, v);
        if walk.direction.dot(point.normal) > 0.0 {
            meet_straight(scene, &point, &walk, work, scores);
        }
    }
}

/// Whether the disk of a lamp is looked for in a drawn direction as well.
fn is_large(scene: &Prepared, lamp: usize, walk: &Walk) -> bool {
    let lamp = &scene.lamps[lamp];
    let reach = LARGE * lamp.radius;
    lamp.position.distance_squared(walk.origin) < reach * reach
}

fn join_straight(
    scene: &Prepared,
    point: &SurfacePoint,
    walk: &Walk,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    let position = walk.origin;
    let site = Site::Surface(point);
    for i in 0..work.targets.len() {
        let target = work.targets[i];
        let lamp = lamp_point(scene, target, draws);
        if !straight(position, lamp, &mut work.bridge) {
            continue;
        }
        let lobe = site.lobe(walk.direction, work.bridge.first);
        if lobe > 0.0 {
            let large = is_large(scene, target.lamp, walk);
            send(
                scene, target, position, lamp, lobe, large, walk, work, scores,
            );
        }
    }
}

fn meet_straight(
    scene: &Prepared,
    point: &SurfacePoint,
    walk: &Walk,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    let lobe = point.shading_normal.dot(walk.direction) / PI;
    for i in 0..work.targets.len() {
        let target = work.targets[i];
        if !is_large(scene, target.lamp, walk) {
            continue;
        }
        if let Some((start, end)) = lamp_ahead(scene, target, walk, work) {
            send(scene, target, start, end, lobe, true, walk, work, scores);
        }
    }
}

/// Disk lamps that the camera looks at, straight or in the underside of the water surface: their unscattered light is
/// on no other path.
fn see_lamps(scene: &Prepared, active: &[usize], ray: &CameraRay, share: f64, scores: &mut Scores) {
    let Some(segment) = ray.in_water else { return };
    let factor = share * ray.entry_factor;
    if active.iter().all(|&i| scene.lamps[i].radius == 0.0) {
        return;
    }
    see_lamps_along(scene, active, segment, 0.0, factor, scores);
    let (Some(boundary), End::Boundary(length)) = (&scene.boundary, ray.end()) else {
        return;
    };
    let reflectance = boundary.internal_reflectance(segment.direction.z);
    if reflectance == 0.0 {
        return;
    }
    let mut origin = segment.origin + length * segment.direction;
    origin.z = boundary.height;
    let direction = flip(segment.direction);
    let hit = scene
        .geometry
        .closest(origin, direction, f64::INFINITY, Primitive::None);
    let reflected = Segment {
        origin,
        direction,
        length: hit.map_or(f64::INFINITY, |h| h.t),
    };
    see_lamps_along(
        scene,
        active,
        reflected,
        length,
        reflectance * factor,
        scores,
    );
}

/// Disk lamps on `segment`, which starts `range_m` into the water and whose light arrives with `factor`.
fn see_lamps_along(
    scene: &Prepared,
    active: &[usize],
    segment: Segment,
    range_m: f64,
    factor: f64,
    scores: &mut Scores,
) {
    for &i in active {
        let lamp = &scene.lamps[i];
        let Some((t, radiance)) =
            lamp.radiance_along(segment.origin, segment.direction, segment.length)
        else {
            continue;
        };
        let transmittance = scene
            .medium
            .as_ref()
            .map_or([1.0; 3], |m| m.transmittance(range_m + t));
        let light = std::array::from_fn(|k| factor * radiance[k] * transmittance[k]);
        scores.add(Source::Lamp(i), Way::Direct, light);
    }
}
