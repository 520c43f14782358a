// The underside of the water surface as a mirror, unfolded.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::bvh::occluded;
import package::common::interface::{flip, internal_reflectance, is_above, mirror};
import package::common::layout::{HAS_QUADS, HAS_SURFACE, HAS_TRIANGLES, NONE, scene};

/// A surface at the very end of a segment does not block it: rounding of its ends.
const REACH: f32 = 0.999998;

fn is_clear_line(origin: vec3f, direction: vec3f, length: f32, start_primitive: u32) -> bool {
    if !HAS_QUADS && !HAS_TRIANGLES {
        return true;
    }
    return !occluded(origin, direction, length * REACH, start_primitive);
}

/// Factor of the straight unfolded segment: 0 where a surface blocks it or it leaves the water, else the product of the
/// reflectances of the water surface that it meets.
fn segment_factor(start: vec3f, end: vec3f, start_primitive: u32) -> f32 {
    let offset = end - start;
    let length = length(offset);
    if length == 0.0 {
        return 1.0;
    }
    let direction = offset / length;
    let start_above = is_above(start);
    let end_above = is_above(end);
    let origin = mirrored_if(start, start_above);
    let towards = select(direction, flip(direction), start_above);
    if start_above == end_above {
        return select(0.0, 1.0, is_clear_line(origin, towards, length, start_primitive));
    }
    let reflectance = internal_reflectance(abs(direction.z));
    if reflectance == 0.0 {
        return 0.0;
    }
    let to_plane = clamp((scene.surface_height_m - start.z) / direction.z, 0.0, length);
    if !is_clear_line(origin, towards, to_plane, start_primitive) {
        return 0.0;
    }
    let crossing = mirrored_if(start + to_plane * direction, end_above);
    let onwards = select(direction, flip(direction), end_above);
    return select(0.0, reflectance, is_clear_line(crossing, onwards, length - to_plane, NONE));
}

fn mirrored_if(point: vec3f, above: bool) -> vec3f {
    if HAS_SURFACE && above {
        return mirror(point);
    }
    return point;
}
