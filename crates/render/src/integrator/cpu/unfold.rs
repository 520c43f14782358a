//! The underside of the water surface as a mirror, unfolded.
//!
//! A path that reflects at the flat surface is a straight path in a space in which everything below the
//! surface is repeated, mirrored, above it. Camera walks and bridges live in that space: a bridge to the lamp
//! holds all paths with an even number of reflections, a bridge to its mirror image all with an odd number,
//! and each crossing of the plane costs the Fresnel reflectance.

use glam::DVec3;

use crate::prepare::{Prepared, Primitive};

/// Reflects the vertical component of a direction.
#[inline]
pub fn flip(direction: DVec3) -> DVec3 {
    DVec3::new(direction.x, direction.y, -direction.z)
}

/// Factor of the straight unfolded segment from `start` (on `from`) to `end`: 0 where a surface blocks it or
/// it leaves the water, else the product of the surface reflectances it meets.
pub fn segment_factor(scene: &Prepared, start: DVec3, end: DVec3, from: Primitive) -> f64 {
    let offset = end - start;
    let length = offset.length();
    if length == 0.0 {
        return 1.0;
    }
    let direction = offset / length;
    let Some(boundary) = scene.boundary else {
        return clear(scene, start, direction, length, from);
    };
    let (start_above, end_above) = (start.z > boundary.height, end.z > boundary.height);
    let real = |point: DVec3, direction: DVec3, above: bool| {
        if above {
            (scene.mirror(point), flip(direction))
        } else {
            (point, direction)
        }
    };
    if start_above == end_above {
        let (origin, direction) = real(start, direction, start_above);
        return clear(scene, origin, direction, length, from);
    }
    let reflectance = boundary.internal_reflectance(direction.z.abs());
    if reflectance == 0.0 {
        return 0.0;
    }
    let to_plane = ((boundary.height - start.z) / direction.z).clamp(0.0, length);
    let (origin, towards) = real(start, direction, start_above);
    if clear(scene, origin, towards, to_plane, from) == 0.0 {
        return 0.0;
    }
    let (origin, towards) = real(start + to_plane * direction, direction, end_above);
    reflectance * clear(scene, origin, towards, length - to_plane, Primitive::None)
}

/// 1 where nothing blocks, else 0.
fn clear(scene: &Prepared, origin: DVec3, direction: DVec3, length: f64, from: Primitive) -> f64 {
    let reach = length * (1.0 - 1e-12);
    if scene.geometry.occluded(origin, direction, reach, from) {
        0.0
    } else {
        1.0
    }
}
