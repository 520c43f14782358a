//! Daylight at a Lambertian surface: emission, the sun, new directions.

use std::f64::consts::PI;

use super::{
    ambient_path::{Tracer, Walk},
    ambient_window::diffuse_irradiance,
    sun_line::sun_reaches,
};
use crate::{
    integrator::sampling::{
        Draws,
        directions::{cosine_hemisphere, sin2_half, turn},
    },
    prepare::{Prepared, SurfacePoint},
};

/// Share of directions drawn around the sun.
const SUN_SHARE_SURFACE: f64 = 0.3;

impl Tracer<'_> {
    /// On a surface in the water, in the air or in space: scores it and goes on from it.
    pub(super) fn meet_surface(&mut self, mut walk: Walk, point: &SurfacePoint) {
        walk.met_surface = true;
        if point.emission != [0.0; 3] {
            self.score(&walk, walk.way(), point.emission);
        }
        if walk.events >= self.max_events || point.reflectance == [0.0; 3] {
            return;
        }
        walk.events += 1;
        walk.spectral.scale(point.reflectance);
        let sun = sunlight_on(self.scene, point, &walk);
        self.score(&walk, walk.way(), sun);
        let depth = self.scene.depth(walk.origin);
        let diffuse = diffuse_irradiance(self.scene, &walk, depth, point).map(|e| e / PI);
        let expected = std::array::from_fn(|k| point.emission[k] + sun[k] + diffuse[k]);
        self.window.set_reference(walk.spectral.weight(), expected);
        for _ in 0..self.copies(&mut walk, diffuse) {
            let mut copy = walk;
            if leave_surface(self.scene, point, &mut copy, self.draws) {
                copy.leading = false;
                self.pending.push(copy);
            }
            walk.leading = false;
        }
    }
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
    let range = scene.depth(walk.origin) / towards.z;
    let transmittance = scene
        .medium
        .as_ref()
        .map_or([1.0; 3], |m| m.transmittance(range));
    std::array::from_fn(|k| sun.irradiance[k] * transmittance[k] * cosine / PI)
}

/// A direction from the cosine lobe or, in scattering sunlit water, around the sun; false where it would
/// lead into the surface.
fn leave_surface(
    scene: &Prepared,
    point: &SurfacePoint,
    walk: &mut Walk,
    draws: &mut Draws,
) -> bool {
    let (u, v) = walk.direction_numbers(draws);
    let lobe = match (&scene.sun, &scene.medium) {
        (Some(sun), Some(medium)) if !walk.in_air && medium.scatters() => Some((sun, medium)),
        _ => None,
    };
    let Some((sun, medium)) = lobe else {
        walk.direction = cosine_hemisphere(point.shading_normal, u, v);
        return walk.direction.dot(point.normal) > 0.0;
    };
    let around_sun = draws.uniform() < SUN_SHARE_SURFACE;
    let mut from_sun = None;
    walk.direction = if around_sun {
        let x = medium.phase.sample_x(u);
        from_sun = Some(x);
        turn(sun.towards, x, v)
    } else {
        cosine_hemisphere(point.shading_normal, u, v)
    };
    let cosine = point.shading_normal.dot(walk.direction);
    if cosine <= 0.0 || walk.direction.dot(point.normal) <= 0.0 {
        return false;
    }
    let x = from_sun.unwrap_or_else(|| sin2_half(walk.direction, sun.towards));
    let density =
        (1.0 - SUN_SHARE_SURFACE) * cosine / PI + SUN_SHARE_SURFACE * medium.phase.value(x);
    walk.spectral.scale_all(cosine / PI / density);
    true
}
