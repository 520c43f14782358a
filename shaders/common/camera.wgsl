// Rays to the first surface, and image points around small lamps in view.
// Host: crates/render/src/kernels/records.rs (image points of lamps). Checked by: tests/system/gpu.rs.
import package::common::bvh::{Hit, closest};
import package::common::surface::{SurfacePoint, lit_point};
import package::common::interface::{distance_to_surface, external_reflectance, is_above, refract_into_water};
import package::common::layer_tables::BY_SCATTERING;
import package::common::layers::drawn_along;
import package::common::layout::{GIVEN_RAYS, HAS_AIR, HAS_SCATTERING, INFINITE, NONE, rays, scene};
import package::common::math::circle;
import package::common::settings::spot_count;
import package::common::tables::table_f32;

/// Share of image points drawn around lamps, and how far around, pixels.
const SPOT_SHARE: f32 = 0.5;
const SPOT_REACH_PX: f32 = 1.5;
/// The even disc about a lamp, in octaves (of e) of the distances around it that it weighs as much as.
const SPOT_DISC: f32 = 0.5;
/// Optical depth (scattering) of the camera ray below which unscattered light is sampled apart.
const SPLIT_BELOW: f32 = 0.7;

/// What ends a segment.
const NOTHING: u32 = 0u;
const SCATTER: u32 = 1u;
const SURFACE: u32 = 2u;
const BOUNDARY: u32 = 3u;

struct End {
    kind: u32,
    t: f32,
    primitive: u32,
    /// Where on the primitive.
    local: vec2f,
}

/// A camera ray to the first surface; `wet` tells whether a part runs through the water (or space without water),
/// which starts at `origin`.
struct CameraRay {
    wet: bool,
    origin: vec3f,
    direction: vec3f,
    length: f32,
    entry_factor: f32,
    in_air: bool,
    end: End,
}

/// An image point of a pixel, from its upper left corner, and the factor of what is seen there (0: outside).
struct ImagePoint {
    offset: vec2f,
    factor: f32,
}

/// The surface at the end of a segment along `direction`.
fn end_point(end: End, direction: vec3f) -> SurfacePoint {
    return lit_point(Hit(end.t, end.primitive, end.local), direction, false);
}

fn no_point() -> SurfacePoint {
    return SurfacePoint(vec3f(0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0), NONE, 0.0, 0.0, 0u, vec3f(0.0));
}

/// The point that samples look from where neither port nor opening is before it: the camera, which is the origin, or that of given rays.
fn eye() -> vec3f {
    if GIVEN_RAYS {
        return rays[0].xyz;
    }
    return vec3f(0.0);
}

/// Follows the ray from `start` to the first surface, through the water surface if it is in the air.
fn camera_ray(start: vec3f, direction: vec3f) -> CameraRay {
    let nothing = End(NOTHING, INFINITE, NONE, vec2f(0.0));
    var ray = CameraRay(true, start, direction, INFINITE, 1.0, HAS_AIR && is_above(start), nothing);
    if ray.in_air {
        let down = -direction.z;
        let to_water = select(INFINITE, (start.z - scene.surface_height_m) / down, down > 0.0);
        if down <= 0.0 || closest(start, direction, to_water, NONE).primitive != NONE {
            ray.wet = false;
            return ray;
        }
        ray.entry_factor = (1.0 - external_reflectance(down)) / (scene.refractive_index * scene.refractive_index);
        ray.origin = vec3f((start + to_water * direction).xy, scene.surface_height_m);
        ray.direction = refract_into_water(direction);
    }
    ray.end = full_segment(ray.origin, ray.direction, NONE);
    ray.length = ray.end.t;
    return ray;
}

/// The end of a segment in the water if nothing scatters on it.
fn full_segment(origin: vec3f, direction: vec3f, start_primitive: u32) -> End {
    let to_boundary = distance_to_surface(origin, direction);
    let hit = closest(origin, direction, to_boundary, start_primitive);
    if hit.primitive != NONE {
        return End(SURFACE, hit.t, hit.primitive, hit.local);
    }
    if to_boundary < INFINITE {
        return End(BOUNDARY, to_boundary, NONE, vec2f(0.0));
    }
    return End(NOTHING, INFINITE, NONE, vec2f(0.0));
}

/// Whether the water before the end of `ray` is so clear that scattered and unscattered light are sampled apart.
fn is_clear(ray: CameraRay) -> bool {
    if !HAS_SCATTERING || !ray.wet {
        return true;
    }
    let drawn = drawn_along(ray.origin, ray.direction, ray.length, BY_SCATTERING);
    return (scene.b.x + scene.b.y + scene.b.z) / 3.0 * drawn < SPLIT_BELOW;
}

/// Centre of a lamp's image relative to the corner of a pixel, and ln of the range of distances about it.
fn spot(index: u32, column: u32, row: u32) -> vec3f {
    let record = scene.spot_table + 5u * index;
    // Whole pixels and the rest apart, so that the difference is exact.
    let whole = vec2f(table_f32(record) - f32(column), table_f32(record + 1u) - f32(row));
    return vec3f(whole + vec2f(table_f32(record + 2u), table_f32(record + 3u)), table_f32(record + 4u));
}

fn is_near(s: vec3f) -> bool {
    return distance(s.xy, vec2f(0.5)) < SPOT_REACH_PX;
}

fn spot_density(s: vec3f, point: vec2f) -> f32 {
    let d = point - s.xy;
    let r2 = dot(d, d);
    let least = spot_least(s);
    if r2 > SPOT_REACH_PX * SPOT_REACH_PX {
        return 0.0;
    }
    return 1.0 / (6.2831853 * (s.z + SPOT_DISC) * max(r2, least * least));
}

/// Distance below which image points about a lamp are even.
fn spot_least(s: vec3f) -> f32 {
    return SPOT_REACH_PX * exp(-s.z);
}

fn spot_sample(s: vec3f, u: f32, v: f32) -> vec2f {
    let x = u * (s.z + SPOT_DISC);
    let r = select(spot_least(s) * sqrt(max(x - s.z, 0.0) / SPOT_DISC), SPOT_REACH_PX * exp(-x), x < s.z);
    return s.xy + r * circle(v);
}

/// An image point of a pixel from two numbers in (0, 1).
fn choose_image_point(column: u32, row: u32, u: f32, v: f32) -> ImagePoint {
    var count = 0u;
    for (var i = 0u; i < spot_count(); i++) {
        count += select(0u, 1u, is_near(spot(i, column, row)));
    }
    if count == 0u {
        return ImagePoint(vec2f(u, v), 1.0);
    }
    var point = vec2f((u - SPOT_SHARE) / (1.0 - SPOT_SHARE), v);
    let pick = u / SPOT_SHARE * f32(count);
    if u < SPOT_SHARE {
        var rest = u32(pick);
        for (var i = 0u; i < spot_count(); i++) {
            let s = spot(i, column, row);
            if is_near(s) {
                if rest == 0u {
                    point = spot_sample(s, fract(pick), v);
                    break;
                }
                rest -= 1u;
            }
        }
    }
    if min(point.x, point.y) < 0.0 || max(point.x, point.y) >= 1.0 {
        return ImagePoint(point, 0.0);
    }
    var around = 0.0;
    for (var i = 0u; i < spot_count(); i++) {
        let s = spot(i, column, row);
        if is_near(s) {
            around += spot_density(s, point);
        }
    }
    return ImagePoint(point, 1.0 / (1.0 - SPOT_SHARE + SPOT_SHARE * around / f32(count)));
}
