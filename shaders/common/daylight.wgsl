// Daylight far from any object, which steers walks, and sunlight scattered once on a segment.
// Host: crates/render/src/prepare/daylight_field/ (makes the tables). Checked by: tests/system/ (closed_form,
// validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::bvh::occluded;
import package::common::interface::depth_of;
import package::common::layer_distance::distance_of;
import package::common::layer_tables::{BY_ATTENUATION, BY_SCATTERING};
import package::common::layers::{drawn_along, water_at, way_along};
import package::common::layout::{HAS_GEOMETRY_IN_AIR, HAS_LAYERS, HAS_QUADS, HAS_SUN, HAS_SURFACE, HAS_TRIANGLES, INFINITE, NONE, Spectrum, far_rows, scene};
import package::common::math::{expm1, ln_1p, minus_ln};
import package::common::medium::one_minus_exp;
import package::common::phase::sun_phase_value;
import package::common::rng::uniform_number;
import package::common::tables::{table_row, table_row_f32};
import package::common::spectrum::{water_c, water_b, sun_irradiance};

const COSINES: u32 = 40u;
const DEPTHS: u32 = 97u;
/// Largest exponent of the correction for narrowly scattered sunlight.
const MAX_NARROW: f32 = 30.0;
/// Rows of the field's record: decays and greatest depth; narrow rates; cosine and sine of the sun's azimuth; the first
/// rows of the tables.
const DECAYS: u32 = 0u;
const NARROW_RATES: u32 = 1u;
const SUN_AZIMUTH: u32 = 2u;
const TABLES: u32 = 3u;
/// Tables, in their order in the record.
const SCATTERED: u32 = 0u;
const DOWN: u32 = 1u;
const UP: u32 = 2u;
const WORTHS: u32 = 3u;

/// Node above a depth, fraction of the way to the next one, and how far it is beyond the last, m.
struct FieldDepth {
    node: u32,
    fraction: f32,
    beyond_m: f32,
}

fn field_depth(depth_m: f32) -> FieldDepth {
    let depth = max(depth_m, 0.0);
    let greatest = field_row(DECAYS).w;
    if depth >= greatest {
        return FieldDepth(DEPTHS - 2u, 1.0, depth - greatest);
    }
    let steps = sqrt(depth / greatest) * f32(DEPTHS - 1u);
    let node = min(u32(steps), DEPTHS - 2u);
    return FieldDepth(node, steps - f32(node), 0.0);
}

/// Row `i` of the record.
fn field_row(i: u32) -> vec4f {
    return table_row_f32(scene.field_table + i);
}

/// Entry `i` of a table.
fn entry(table: u32, i: u32) -> Spectrum {
    return bitcast<vec4f>(far_rows[table_row(scene.field_table + TABLES)[table] + i]).xyz;
}

fn exponential(at: FieldDepth, ln: Spectrum) -> Spectrum {
    return exp(clamp(ln - at.beyond_m * field_row(DECAYS).xyz, vec3f(-87.0), vec3f(87.0)));
}

/// Bin of the cosine below a direction and the weight of the next one; the same for azimuths.
struct FieldDirection {
    bin: u32,
    weight: f32,
    azimuth: u32,
    azimuth_weight: f32,
    azimuths: u32,
}

fn field_direction(view: vec3f) -> FieldDirection {
    let steps = clamp(0.5 * (view.z + 1.0) * f32(COSINES) - 0.5, 0.0, f32(COSINES - 1u));
    let bin = min(u32(steps), COSINES - 2u);
    let sun = table_row(scene.field_table + SUN_AZIMUTH);
    let azimuths = sun.z;
    if azimuths == 1u {
        return FieldDirection(bin, steps - f32(bin), 0u, 0.0, 1u);
    }
    let across = max(length(view.xy), 1e-30);
    let cosine = dot(view.xy, bitcast<vec2f>(sun.xy)) / across;
    let turn = sqrt(clamp(0.5 * (1.0 - cosine), 0.0, 1.0)) * f32(azimuths - 1u);
    let low = min(u32(turn), azimuths - 2u);
    return FieldDirection(bin, steps - f32(bin), low, turn - f32(low), azimuths);
}

/// Logarithm of the radiance at a node and a bin.
fn ln_scattered(d: FieldDirection, node: u32, bin: u32) -> Spectrum {
    let i = (node * COSINES + bin) * d.azimuths + d.azimuth;
    if d.azimuths == 1u {
        return entry(SCATTERED, i);
    }
    return mix(entry(SCATTERED, i), entry(SCATTERED, i + 1u), d.azimuth_weight);
}

/// Radiance at a point in the water in direction `view` that scattered more than once, or that came from the sky and
/// scattered.
fn field_scattered(point: vec3f, view: vec3f, line: Spectrum) -> Spectrum {
    let depth_m = depth_of(point);
    let at = field_depth(depth_m);
    let d = field_direction(view);
    let upper = mix(ln_scattered(d, at.node, d.bin), ln_scattered(d, at.node, d.bin + 1u), d.weight);
    let lower = mix(ln_scattered(d, at.node + 1u, d.bin), ln_scattered(d, at.node + 1u, d.bin + 1u), d.weight);
    let broad = exponential(at, mix(upper, lower, at.fraction));
    if view.z <= 0.0 {
        return broad;
    }
    let scattering = drawn_along(point, vec3f(0.0, 0.0, 1.0), depth_m, BY_SCATTERING);
    let narrow = min(field_row(NARROW_RATES).xyz * scattering, vec3f(MAX_NARROW));
    return max(broad, line * max(exp(narrow) - Spectrum(1.0), narrow));
}

/// What a direction is worth where light scatters.
struct Worth {
    /// Share of directions to draw around the sun where a walk comes along it.
    sun_share: f32,
    /// Light from there but for the sunlight, which is over the phase function towards the sun.
    light: f32,
    sunlight: f32,
}

/// First entry of what directions are worth at a depth, from the nearest node.
fn worths_at(depth_m: f32) -> u32 {
    let at = field_depth(depth_m);
    let node = at.node + select(0u, 1u, at.fraction > 0.5);
    return node * COSINES * table_row(scene.field_table + SUN_AZIMUTH).z;
}

/// The same of a direction, of those whose first entry is `first`.
fn worth_along(first: u32, view: vec3f) -> Worth {
    let d = field_direction(view);
    let bin = d.bin + select(0u, 1u, d.weight > 0.5);
    let azimuth = d.azimuth + select(0u, 1u, d.azimuth_weight > 0.5);
    let row = entry(WORTHS, first + bin * d.azimuths + azimuth);
    return Worth(row.x, row.y, row.z);
}

/// Plane irradiance at `depth_m` on a surface whose normal has the vertical component `up`, without the sun's beam.
fn field_irradiance(depth_m: f32, up: f32) -> Spectrum {
    let at = field_depth(depth_m);
    let down = mix(entry(DOWN, at.node), entry(DOWN, at.node + 1u), at.fraction);
    let upward = mix(entry(UP, at.node), entry(UP, at.node + 1u), at.fraction);
    return mix(exponential(at, upward), exponential(at, down), 0.5 * (1.0 + up));
}

/// Integral over a segment of e^(−start − rate·t), m; per channel, from the denser end, so that no exponent is above 0.
fn attenuation_integral(start: Spectrum, rate: Spectrum, length: f32) -> Spectrum {
    let x = rate * length;
    let dense = start + min(x, Spectrum(0.0));
    let depth = abs(x);
    let thin = length * (1.0 - 0.5 * depth + depth * depth / 6.0);
    let thick = one_minus_exp(depth) / abs(rate);
    return exp(-min(dense, Spectrum(87.0))) * select(thick, thin, depth < Spectrum(1e-4));
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

/// The same where the water varies, for a sun of 1 W/m² and a phase function of 1 1/sr, by a point of the segment: drawn, in
/// one of the channels, as it is attenuated in layers whose channels vary alike.
fn sunlight_in_layers(origin: vec3f, direction: vec3f, length: f32) -> Spectrum {
    let drawn = drawn_along(origin, direction, length, BY_ATTENUATION);
    let rate = water_c() * (1.0 - direction.z / scene.sun_towards.z);
    let integral = attenuation_integral(Spectrum(0.0), rate, drawn);
    let channel = min(u32(uniform_number() * 3.0), 2u);
    let at = attenuation_sample(rate[channel], drawn, uniform_number());
    let t = distance_of(origin, direction, length, at, BY_ATTENUATION);
    let point = origin + t * direction;
    let here = water_at(point, BY_ATTENUATION);
    let even = exp(-clamp(rate * at, Spectrum(-87.0), Spectrum(87.0))) / integral;
    let density = here.relative * (even.x + even.y + even.z) / 3.0;
    if !(density > 0.0) || (may_be_shadowed(origin, direction, length) && !sun_reaches(point, NONE)) {
        return Spectrum(0.0);
    }
    let towards = scene.sun_towards;
    let depth = way_along(origin, direction, t, BY_ATTENUATION).depth + way_along(point, towards, depth_of(point) / towards.z, BY_ATTENUATION).depth;
    return here.b * exp(-min(depth, Spectrum(87.0))) / density;
}

/// Radiance that the sun's light scattered once on a segment sends back to its start; `x` is sin²(θ/2) of the angle
/// between the segment's direction and the sun's.
fn scattered_sunlight(origin: vec3f, direction: vec3f, length: f32, x: f32) -> Spectrum {
    if !HAS_SUN || !HAS_SURFACE {
        return Spectrum(0.0);
    }
    if HAS_LAYERS {
        return sunlight_in_layers(origin, direction, length) * sun_irradiance() * sun_phase_value(x);
    }
    let start = water_c() * (depth_of(origin) / scene.sun_towards.z);
    let rate = water_c() * (1.0 - direction.z / scene.sun_towards.z);
    let integral = select(Spectrum(0.0), attenuation_integral(start, rate, length), water_b() > Spectrum(0.0));
    let channels = select(vec3u(0u), vec3u(1u), integral > Spectrum(0.0));
    let lit = channels.x + channels.y + channels.z;
    let factor = water_b() * sun_irradiance() * sun_phase_value(x);
    if lit == 0u {
        return Spectrum(0.0);
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
        return Spectrum(0.0);
    }
    var values: Spectrum;
    var density = 0.0;
    for (var k = 0u; k < 3u; k++) {
        if integral[k] > 0.0 {
            values[k] = exp(-clamp(start[k] + rate[k] * t, 0.0, 87.0));
            density += values[k] / integral[k];
        }
    }
    if !(density > 0.0) {
        return Spectrum(0.0);
    }
    return factor * values * (f32(lit) / density);
}
