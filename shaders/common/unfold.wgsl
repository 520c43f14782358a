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
    let crosses = HAS_SURFACE && start_above != end_above;
    var factor = 1.0;
    var to_plane = length;
    if crosses {
        factor = internal_reflectance(abs(direction.z));
        to_plane = clamp((scene.surface_height_m - start.z) / direction.z, 0.0, length);
    }
    // Before the water surface and, where it is crossed, beyond it.
    var origin = mirrored_if(start, start_above);
    var towards = select(direction, flip(direction), start_above);
    var reach = to_plane;
    var left = start_primitive;
    var beyond = !crosses;
    loop {
        if factor == 0.0 || !is_clear_line(origin, towards, reach, left) {
            return 0.0;
        }
        if !HAS_SURFACE || beyond {
            break;
        }
        origin = mirrored_if(start + to_plane * direction, end_above);
        towards = select(direction, flip(direction), end_above);
        reach = length - to_plane;
        left = NONE;
        beyond = true;
    }
    return factor;
}

fn mirrored_if(point: vec3f, above: bool) -> vec3f {
    if HAS_SURFACE && above {
        return mirror(point);
    }
    return point;
}
