//! Light of the lamps that scatters nowhere in the water: lamp, first surface, camera; and lamps that the camera sees.
//!
//! It is smooth but for the texture and the edges in the pixel, and cheap, so that it is sampled at more image points
//! than the walks, which leave it out.

use glam::DVec3;

use super::{
    camera_ray::{CameraRay, End, Segment},
    lamp_join::Site,
    lamp_target::{LampWorkspace, Target, choose_targets, emitted, lamp_point},
    score::{Scores, Source, Way},
    unfold::{flip, segment_factor},
};
use crate::{
    integrator::sampling::{Draws, directions::cosine_hemisphere},
    prepare::{Prepared, Primitive, SurfacePoint},
};

/// Distance from a surface, in radii, below which a lamp's disk is also looked for in a drawn direction: joining a
/// surface to points of a disk close to it has heavy tails.
const LARGE: f64 = 4.0;

/// The surface at the end of a camera ray.
struct Seen {
    point: SurfacePoint,
    primitive: Primitive,
    position: DVec3,
    /// Direction of the camera ray there.
    arrived: DVec3,
    /// Length of the ray in the water, m.
    range_m: f64,
    /// Factor of all light that comes from there.
    factor: f64,
}

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
    let seen = Seen {
        point,
        primitive,
        position: start.origin + t * start.direction,
        arrived: start.direction,
        range_m: t,
        factor: ray.entry_factor * share,
    };
    choose_targets(scene, active, ray, None, draws, &mut work.targets);
    for &target in &work.targets {
        join(scene, target, &seen, draws, scores);
    }
    if work.targets.iter().any(|&t| is_large(scene, t, &seen)) {
        let (u, v) = (draws.uniform(), draws.uniform());
        let direction = cosine_hemisphere(seen.point.shading_normal, u, v);
        if direction.dot(seen.point.normal) > 0.0 {
            for &target in &work.targets {
                meet(scene, target, &seen, direction, scores);
            }
        }
    }
}

/// Whether the disk of a lamp is looked for in a drawn direction as well.
fn is_large(scene: &Prepared, target: Target, seen: &Seen) -> bool {
    let lamp = &scene.lamps[target.lamp];
    let reach = LARGE * lamp.radius;
    lamp.position.distance_squared(seen.position) < reach * reach
}

/// Light from a point of the lamp.
fn join(scene: &Prepared, target: Target, seen: &Seen, draws: &mut Draws, scores: &mut Scores) {
    let end = lamp_point(scene, target, draws);
    let distance = seen.position.distance(end);
    if distance > 0.0 {
        let towards = (end - seen.position) / distance;
        send(scene, target, seen, end, towards, distance, scores);
    }
}

/// Light from where the drawn `direction` meets the lamp's disk.
fn meet(scene: &Prepared, target: Target, seen: &Seen, direction: DVec3, scores: &mut Scores) {
    if target.mirrored || !is_large(scene, target, seen) {
        return;
    }
    let to_boundary = scene.distance_to_boundary(seen.position, direction);
    let lamp = &scene.lamps[target.lamp];
    if let Some((t, _)) = lamp.radiance_along(seen.position, direction, to_boundary) {
        let end = seen.position + t * direction;
        send(scene, target, seen, end, direction, t, scores);
    }
}

/// Adds the light from the lamp point `end`, in unfolded space, which lies `distance` away along `towards`. A large disk
/// is found in two ways, which share by the balance heuristic.
fn send(
    scene: &Prepared,
    target: Target,
    seen: &Seen,
    end: DVec3,
    towards: DVec3,
    distance: f64,
    scores: &mut Scores,
) {
    let lamp = &scene.lamps[target.lamp];
    let lobe = Site::Surface(&seen.point).lobe(seen.arrived, towards);
    let relative = emitted(scene, target, -towards);
    if !(lobe > 0.0) || relative == 0.0 {
        return;
    }
    let open = segment_factor(scene, seen.position, end, seen.primitive);
    if open == 0.0 {
        return;
    }
    let by_chance = if is_large(scene, target, seen) && scene.same_side(seen.position, end) {
        open * lamp.facing_area(-towards)
    } else {
        0.0
    };
    let density = distance * distance / lobe + by_chance;
    let factor = seen.factor * target.weight * relative * open / density;
    let transmittance = scene
        .medium
        .as_ref()
        .map_or([1.0; 3], |m| m.transmittance(seen.range_m + distance));
    let light = std::array::from_fn(|k| {
        factor * seen.point.reflectance[k] * lamp.intensity[k] * transmittance[k]
    });
    scores.add(Source::Lamp(target.lamp), Way::Direct, light);
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
