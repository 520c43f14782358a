//! Daylight at a Lambertian surface: emission, the sun, a new direction.

use std::f64::consts::PI;

use super::{ambient_path::Walk, score::Scores, sun_line::sun_reaches};
use crate::{
    integrator::sampling::{
        Draws,
        directions::{cosine_hemisphere, sin2_half, turn},
    },
    prepare::{Prepared, SurfacePoint},
};

/// Share of directions drawn around the sun.
const SUN_SHARE_SURFACE: f64 = 0.3;

/// A surface in the water or in space: emission, the sun, a new direction.
pub(super) fn meet_surface(
    scene: &Prepared,
    point: &SurfacePoint,
    max_events: usize,
    leading: bool,
    walk: &mut Walk,
    draws: &mut Draws,
    scores: &mut Scores,
) -> bool {
    walk.met_surface = true;
    if point.emission != [0.0; 3] {
        walk.score(scores, walk.way(), point.emission);
    }
    if walk.events >= max_events || point.reflectance == [0.0; 3] {
        return false;
    }
    walk.events += 1;
    walk.spectral.scale(point.reflectance);
    let light = sunlight_on(scene, point, walk);
    walk.score(scores, walk.way(), light);
    let (u, v) = if leading {
        (draws.leading(3), draws.leading(4))
    } else {
        (draws.uniform(), draws.uniform())
    };
    new_surface_direction(scene, point, walk, draws, u, v)
}

/// Radiance that a unit-reflectance surface sends on from the unscattered sun, per channel.
fn sunlight_on(scene: &Prepared, point: &SurfacePoint, walk: &Walk) -> [f64; 3] {
    let Some(sun) = &scene.sun else {
        return [0.0; 3];
    };
    let in_water = scene.boundary.as_ref().filter(|_| !walk.in_air);
    let towards = if in_water.is_some() {
        sun.towards
    } else {
        sun.towards_in_air
    };
    let cosine = point.shading_normal.dot(towards);
    if cosine <= 0.0 || point.normal.dot(towards) <= 0.0 {
        return [0.0; 3];
    }
    let Some(boundary) = in_water else {
        let blocked = scene
            .geometry
            .occluded(walk.origin, towards, f64::INFINITY, walk.from);
        return if blocked {
            [0.0; 3]
        } else {
            sun.irradiance_in_air.map(|e| e * cosine / PI)
        };
    };
    if !sun_reaches(scene, sun, boundary, walk.origin, walk.from) {
        return [0.0; 3];
    }
    let range = (boundary.height - walk.origin.z).max(0.0) / towards.z;
    let transmittance = scene
        .medium
        .as_ref()
        .map_or([1.0; 3], |m| m.transmittance(range));
    std::array::from_fn(|k| sun.irradiance[k] * transmittance[k] * cosine / PI)
}

/// A direction from the cosine lobe or, in scattering sunlit water, around the sun.
fn new_surface_direction(
    scene: &Prepared,
    point: &SurfacePoint,
    walk: &mut Walk,
    draws: &mut Draws,
    u: f64,
    v: f64,
) -> bool {
    let lobe = match (&scene.sun, &scene.medium) {
        (Some(sun), Some(medium)) if !walk.in_air && medium.scatters() => Some((sun, medium)),
        _ => None,
    };
    let Some((sun, medium)) = lobe else {
        walk.direction = cosine_hemisphere(point.shading_normal, u, v);
        return walk.direction.dot(point.normal) > 0.0;
    };
    let around_sun = draws.uniform() < SUN_SHARE_SURFACE;
    walk.direction = if around_sun {
        turn(sun.towards, medium.phase.sample_x(u), v)
    } else {
        cosine_hemisphere(point.shading_normal, u, v)
    };
    let cosine = point.shading_normal.dot(walk.direction);
    if cosine <= 0.0 || walk.direction.dot(point.normal) <= 0.0 {
        return false;
    }
    let from_sun = medium.phase.value(sin2_half(walk.direction, sun.towards));
    let density = (1.0 - SUN_SHARE_SURFACE) * cosine / PI + SUN_SHARE_SURFACE * from_sun;
    walk.spectral.scale_all(cosine / PI / density);
    true
}
