// Daylight far from any object, which steers walks, and sunlight scattered once on a segment.
// Twins: crates/render/src/prepare/daylight_field/mod.rs and crates/render/src/integrator/cpu/sun_line.rs.
// Checked by: tests/system/gpu.rs (pictures).
import package::common::bvh::occluded;
import package::common::interface::depth_of;
import package::common::layout::{HAS_GEOMETRY_IN_AIR, HAS_QUADS, HAS_SUN, HAS_SURFACE, HAS_TRIANGLES, INFINITE, NONE, scene, word_f32, words};
import package::common::math::{expm1, ln_1p, minus_ln};
import package::common::phase::phase_value;
import package::common::rng::uniform_number;

const COSINES: u32 = 40u;
const DEPTHS: u32 = 97u;
const AZIMUTHS: u32 = 9u;
/// Largest exponent of the correction for narrowly scattered sunlight.
const MAX_NARROW: f32 = 30.0;
/// Words that describe a channel: c, greatest depth, decay, narrow rate, then the places of three tables.
const CHANNEL_WORDS: u32 = 7u;

/// Node above a depth, fraction of the way to the next one, and −ln of the decay beyond the last.
struct DepthNode {
    node: u32,
    fraction: f32,
    beyond: f32,
}

fn depth_node(channel: u32, depth_m: f32) -> DepthNode {
    let depth = word_f32(channel) * max(depth_m, 0.0);
    let greatest = word_f32(channel + 1u);
    if depth >= greatest {
        return DepthNode(DEPTHS - 2u, 1.0, word_f32(channel + 2u) * (depth - greatest));
    }
    let place = sqrt(depth / greatest) * f32(DEPTHS - 1u);
    let node = min(u32(place), DEPTHS - 2u);
    return DepthNode(node, place - f32(node), 0.0);
}

fn blend(table: u32, node: DepthNode) -> f32 {
    let ln = mix(word_f32(table + node.node), word_f32(table + node.node + 1u), node.fraction) - node.beyond;
    return exp(clamp(ln, -87.0, 87.0));
}

/// Place in azimuth from the sun: node and fraction.
fn azimuth_place(view: vec3f) -> vec2f {
    let sun = scene.field_table + 3u * CHANNEL_WORDS;
    if words[sun] == 0u {
        return vec2f(0.0);
    }
    let across = max(length(view.xy), 1e-30);
    let cosine = (view.x * word_f32(sun + 1u) + view.y * word_f32(sun + 2u)) / across;
    let place = sqrt(clamp(0.5 * (1.0 - cosine), 0.0, 1.0)) * f32(AZIMUTHS - 1u);
    let low = min(floor(place), f32(AZIMUTHS - 2u));
    return vec2f(low, place - low);
}

fn scattered_in(channel: u32, depth_m: f32, view: vec3f, line: f32) -> f32 {
    let place = clamp(0.5 * (view.z + 1.0) * f32(COSINES) - 0.5, 0.0, f32(COSINES - 1u));
    let low = min(u32(place), COSINES - 2u);
    let azimuth = azimuth_place(view);
    let node = depth_node(channel, depth_m);
    var corners: array<f32, 4>;
    for (var i = 0u; i < 4u; i++) {
        let row = (node.node + (i >> 1u)) * COSINES + low + (i & 1u);
        let at = words[channel + 4u] + row * AZIMUTHS + u32(azimuth.x);
        corners[i] = mix(word_f32(at), word_f32(at + 1u), azimuth.y);
    }
    let weight = place - f32(low);
    let ln = mix(mix(corners[0], corners[1], weight), mix(corners[2], corners[3], weight), node.fraction);
    let broad = exp(clamp(ln - node.beyond, -87.0, 87.0));
    if view.z <= 0.0 || line == 0.0 {
        return broad;
    }
    return max(broad, line * expm1(min(word_f32(channel + 3u) * depth_m, MAX_NARROW)));
}

/// Radiance at `depth_m` in direction `view` that scattered more than once, or that came from the sky and scattered.
fn field_scattered(depth_m: f32, view: vec3f, line: vec3f) -> vec3f {
    let first = scene.field_table;
    return vec3f(
        scattered_in(first, depth_m, view, line.x),
        scattered_in(first + CHANNEL_WORDS, depth_m, view, line.y),
        scattered_in(first + 2u * CHANNEL_WORDS, depth_m, view, line.z),
    );
}

/// Plane irradiance at `depth_m` on a surface whose normal has the vertical component `up`, without the sun's beam.
fn field_irradiance(depth_m: f32, up: f32) -> vec3f {
    var irradiance: vec3f;
    let upwards = 0.5 * (1.0 + up);
    for (var k = 0u; k < 3u; k++) {
        let channel = scene.field_table + k * CHANNEL_WORDS;
        let node = depth_node(channel, depth_m);
        irradiance[k] = upwards * blend(words[channel + 5u], node) + (1.0 - upwards) * blend(words[channel + 6u], node);
    }
    return irradiance;
}

/// Integral over a segment of e^(−start − rate·t), m.
fn attenuation_integral(start: f32, rate: f32, length: f32) -> f32 {
    if length >= INFINITE {
        return exp(-min(start, 87.0)) / rate;
    }
    let x = rate * length;
    if abs(x) < 1e-4 {
        return length * exp(-min(start, 87.0)) * (1.0 - 0.5 * x + x * x / 6.0);
    }
    // Both exponents are <= 0, so neither form can overflow.
    if x > 0.0 {
        return exp(-min(start, 87.0)) * -expm1(-x) / rate;
    }
    return exp(-min(start + x, 87.0)) * -expm1(x) / -rate;
}

/// A point of the segment with density proportional to the attenuation.
fn attenuation_sample(rate: f32, length: f32, u: f32) -> f32 {
    if length >= INFINITE {
        return minus_ln(u) / rate;
    }
    let x = rate * length;
    if abs(x) < 1e-6 {
        return u * length;
    }
    let from_dense_end = -ln_1p(u * expm1(-abs(x))) / abs(rate);
    return select(max(length - from_dense_end, 0.0), min(from_dense_end, length), x > 0.0);
}

/// Whether the sun's beam reaches `point` in the water, which lies on `start_primitive`.
fn sun_reaches(point: vec3f, start_primitive: u32) -> bool {
    if !HAS_QUADS && !HAS_TRIANGLES {
        return true;
    }
    let to_surface = depth_of(point) / scene.sun_towards.z;
    if occluded(point, scene.sun_towards, to_surface, start_primitive) {
        return false;
    }
    if !HAS_GEOMETRY_IN_AIR {
        return true;
    }
    let exit = vec3f((point + to_surface * scene.sun_towards).xy, scene.surface_height_m);
    return !occluded(exit, scene.sun_towards_in_air, INFINITE, NONE);
}

/// False only when nothing can lie between the segment and the sun.
fn may_be_shadowed(origin: vec3f, direction: vec3f, length: f32) -> bool {
    if !HAS_QUADS && !HAS_TRIANGLES {
        return false;
    }
    if HAS_GEOMETRY_IN_AIR || length >= INFINITE {
        return true;
    }
    let across = cross(direction, scene.sun_towards);
    if dot(across, across) < 1e-8 {
        return true;
    }
    let end = origin + length * direction;
    let middle = 0.5 * (scene.bounds_lower + scene.bounds_upper);
    let half_size = 0.5 * (scene.bounds_upper - scene.bounds_lower);
    for (var i = 0u; i < 2u; i++) {
        var axis = across;
        if i == 1u {
            axis = cross(scene.sun_towards, across);
        }
        let near = dot(origin, axis);
        let far = dot(end, axis);
        let centre = dot(middle, axis);
        let reach = dot(half_size, abs(axis));
        // A surface that the segment only touches with its end casts no shadow on it.
        let margin = 1e-5 * (abs(centre) + reach);
        if max(near, far) <= centre - reach + margin || min(near, far) >= centre + reach - margin {
            return false;
        }
    }
    return true;
}

/// Radiance that the sun's light scattered once on a segment sends back to its start; `x` is sin²(θ/2) of the angle
/// between the segment's direction and the sun's.
fn scattered_sunlight(origin: vec3f, direction: vec3f, length: f32, x: f32) -> vec3f {
    if !HAS_SUN || !HAS_SURFACE {
        return vec3f(0.0);
    }
    let start = scene.c * (depth_of(origin) / scene.sun_towards.z);
    let rate = scene.c * (1.0 - direction.z / scene.sun_towards.z);
    var integral: vec3f;
    var lit = 0u;
    for (var k = 0u; k < 3u; k++) {
        if scene.b[k] > 0.0 {
            integral[k] = attenuation_integral(start[k], rate[k], length);
        }
        lit += select(0u, 1u, integral[k] > 0.0);
    }
    let factor = scene.b * scene.sun_irradiance * phase_value(x);
    if lit == 0u {
        return vec3f(0.0);
    }
    if !may_be_shadowed(origin, direction, length) {
        return factor * integral;
    }
    // One of the channels with light draws a point.
    var rest = min(u32(uniform_number() * f32(lit)), lit - 1u);
    var channel = 0u;
    for (var k = 0u; k < 3u; k++) {
        if integral[k] > 0.0 {
            if rest == 0u {
                channel = k;
                break;
            }
            rest -= 1u;
        }
    }
    let t = attenuation_sample(rate[channel], length, uniform_number());
    if !sun_reaches(origin + t * direction, NONE) {
        return vec3f(0.0);
    }
    var values: vec3f;
    var density = 0.0;
    for (var k = 0u; k < 3u; k++) {
        if integral[k] > 0.0 {
            values[k] = exp(-clamp(start[k] + rate[k] * t, 0.0, 87.0));
            density += values[k] / integral[k];
        }
    }
    if !(density > 0.0) {
        return vec3f(0.0);
    }
    return factor * values * (f32(lit) / density);
}
