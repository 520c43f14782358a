// Walks that look for daylight: their state, the stack of those that still have to go on, and how many go on.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::air_way::{air_lamps_about, air_lamps_scattered_about};
import package::common::ambient_queue::numbers;
import package::common::surface::SurfacePoint;
import package::common::camera::{End, SURFACE};
import package::common::daylight::{field_irradiance, field_scattered};
import package::common::film::{AMBIENT, add_light, lane};
import package::common::gloss::surface_albedo;
import package::common::interface::depth_of;
import package::common::layer_tables::BY_ATTENUATION;
import package::common::layers::way_along;
import package::common::layout::{HAS_AIR_LAMPS, HAS_DAYLIGHT_FIELD, HAS_MEDIUM, HAS_SUN, PI, Spectrum, counters, dispatch, scene, scratch};
import package::common::math::{turn_change, turned};
import package::common::medium::{ChannelSampling, largest, transmittance_along, one_minus_exp};
import package::common::rng::{next_bits, uniform_number};
import package::common::spectrum::sun_irradiance;

/// The weight window of walks, by the sample's reference.
const LOWEST: f32 = 0.5;
const HIGHEST: f32 = 2.0;
const MOST_COPIES: f32 = 16.0;
const COPIES_PER_SAMPLE: u32 = 256u;
const LEAST_SURVIVAL: f32 = 0.02;
const EMISSION_AHEAD: f32 = 0.1;
const SURE_EVENTS: u32 = 1000u;
const LATE_SURVIVAL: f32 = 0.998;
/// Vectors of a walk on the stack.
const WALK_VECTORS: u32 = 5u;
/// Places of the stack that copies leave free for walks that fork.
const FORKS: u32 = 24u;

const IN_AIR: u32 = 1u;
const SCATTERED_BEFORE: u32 = 2u;
const MET_SURFACE: u32 = 4u;
const LEADING: u32 = 8u;

struct AmbientWalk {
    origin: vec3f,
    direction: vec3f,
    /// `direction` less that towards the sun, without cancellation: the phase function between them needs more than
    /// their digits.
    from_sun: vec3f,
    start_primitive: u32,
    /// IN_AIR, SCATTERED_BEFORE, MET_SURFACE, LEADING.
    flags: u32,
    events: u32,
    channels: ChannelSampling,
    /// Which point of the disks of lamps in the air its segment looks for (common/air_lamps), a whole number below 2^24.
    lamp_point: f32,
}

/// Walks of the sample that still have to go on; the last of them is `top`, unless it is on the stack with the others.
var<private> pending: u32;
var<private> top: AmbientWalk;
var<private> has_top: bool;
var<private> has_reference: bool;
var<private> reference: Spectrum;
var<private> copies_made: u32;

fn stack_size() -> u32 {
    return 3u * dispatch.slots / WALK_VECTORS;
}

fn stack_row(walk: u32, i: u32) -> u32 {
    return (WALK_VECTORS * walk + i) * dispatch.lanes + lane;
}

fn push_walk(w: AmbientWalk) {
    if pending >= stack_size() {
        atomicAdd(&counters.cut_paths, 1u);
        return;
    }
    if has_top {
        store_walk(pending - 1u, top);
    }
    top = w;
    has_top = true;
    pending += 1u;
}

fn store_walk(slot: u32, w: AmbientWalk) {
    let packed = (w.channels.chosen << 8u) | (w.flags << 2u) | w.channels.count;
    // Whole numbers below 2^24 as floats: bit patterns that are no number might not survive.
    scratch[stack_row(slot, 0u)] = vec4f(w.origin, f32(w.start_primitive & 0xffffu));
    scratch[stack_row(slot, 1u)] = vec4f(w.direction, f32(w.start_primitive >> 16u));
    scratch[stack_row(slot, 2u)] = vec4f(w.channels.value, f32(min(w.events, 0xffffffu)));
    scratch[stack_row(slot, 3u)] = vec4f(w.channels.ln_density, f32(packed));
    scratch[stack_row(slot, 4u)] = vec4f(w.from_sun, w.lamp_point);
}

fn pop_walk() -> AmbientWalk {
    pending -= 1u;
    if has_top {
        has_top = false;
        return top;
    }
    let a = scratch[stack_row(pending, 0u)];
    let b = scratch[stack_row(pending, 1u)];
    let c = scratch[stack_row(pending, 2u)];
    let d = scratch[stack_row(pending, 3u)];
    let e = scratch[stack_row(pending, 4u)];
    let packed = u32(d.w);
    return AmbientWalk(
        a.xyz,
        b.xyz,
        e.xyz,
        u32(a.w) | (u32(b.w) << 16u),
        (packed >> 2u) & 0x3fu,
        u32(c.w),
        ChannelSampling(c.xyz, d.xyz, packed & 3u, packed >> 8u),
        e.w,
    );
}

/// The walk along a direction that was not found from the one towards the sun.
fn along(walk: AmbientWalk, direction: vec3f) -> AmbientWalk {
    var w = walk;
    w.direction = direction;
    w.from_sun = direction - scene.sun_towards;
    return w;
}

/// Where a walk goes, and that less the direction towards the sun, as a walk holds both.
struct Heading {
    direction: vec3f,
    from_sun: vec3f,
}

fn heading_along(direction: vec3f) -> Heading {
    return Heading(direction, direction - scene.sun_towards);
}

/// Turned by an angle of which `x` is sin²(θ/2), from a walk's own direction or the sun's, by `u` turns about it.
fn turned_heading(w: AmbientWalk, around_sun: bool, x: f32, u: f32) -> Heading {
    if around_sun {
        let from_sun = turn_change(scene.sun_towards, x, u);
        return Heading(turned(scene.sun_towards, from_sun), from_sun);
    }
    let change = turn_change(w.direction, x, u);
    return Heading(turned(w.direction, change), w.from_sun + change);
}

fn headed(walk: AmbientWalk, heading: Heading) -> AmbientWalk {
    var w = walk;
    w.direction = heading.direction;
    w.from_sun = heading.from_sun;
    return w;
}

/// sin²(θ/2) of the angle between the sun's direction and one that is it and `from_sun`.
fn sin2_half_to_sun(from_sun: vec3f) -> f32 {
    return min(0.25 * dot(from_sun, from_sun), 1.0);
}

fn has(w: AmbientWalk, flag: u32) -> bool {
    return (w.flags & flag) != 0u;
}

/// Adds the light that a walk of this weight brings.
fn score(w: AmbientWalk, weight: Spectrum, scattered: bool, light: Spectrum) {
    add_light(AMBIENT, 1.0, has(w, MET_SURFACE), scattered, weight * light);
}

/// Random bits and a number in (0, 1) for a direction.
struct DirectionNumbers {
    bits: u32,
    v: f32,
}

fn direction_numbers(w: AmbientWalk) -> DirectionNumbers {
    if has(w, LEADING) {
        return DirectionNumbers(numbers.bits, numbers.v);
    }
    let bits = next_bits();
    return DirectionNumbers(bits, uniform_number());
}

/// Sets what the sample is expected to bring. Only the first call counts.
fn set_reference(weight: Spectrum, expected: Spectrum) {
    if !has_reference {
        reference = weight * expected;
        has_reference = true;
    }
}

/// Light ahead relative to the reference, in the channel that has most of it.
fn relative_light(weight: Spectrum, light: Spectrum) -> f32 {
    if !has_reference {
        return 1.0;
    }
    return largest(select(Spectrum(0.0), weight * light / reference, reference > Spectrum(0.0)));
}

/// Roulette below the weight window; certain death only where nothing at all is ahead.
fn survival_of(value: f32) -> f32 {
    return select(0.0, clamp(value / LOWEST, LEAST_SURVIVAL, 1.0), value > 0.0);
}

/// Number of copies that go on, and the factor of the weight of each.
struct Copies {
    count: u32,
    factor: f32,
}

fn copies_of(w: AmbientWalk, weight: Spectrum, light: Spectrum) -> Copies {
    let value = relative_light(weight, light);
    if value > HIGHEST && copies_made < COPIES_PER_SAMPLE && w.events <= SURE_EVENTS {
        // Never more than the stack has room for: fewer copies weigh more each. A first scattering splits each copy.
        let room = (f32(stack_size()) - f32(pending + FORKS)) / select(1.0, 3.0, w.events == 0u);
        let copies = max(min(round(min(value, MOST_COPIES)), floor(room)), 1.0);
        copies_made += u32(copies) - 1u;
        return Copies(u32(copies), 1.0 / copies);
    }
    // Nothing else ends a path between lossless surfaces in lossless water.
    let survival = survival_of(value) * select(1.0, LATE_SURVIVAL, w.events > SURE_EVENTS);
    if survival >= 1.0 {
        return Copies(1u, 1.0);
    }
    if !(survival > 0.0) || uniform_number() >= survival {
        return Copies(0u, 0.0);
    }
    return Copies(1u, 1.0 / survival);
}

/// Light that has still to be found in the water along a segment, apart from a surface at its end.
fn light_ahead(w: AmbientWalk, end: End, line: Spectrum) -> Spectrum {
    if !HAS_DAYLIGHT_FIELD && !HAS_AIR_LAMPS {
        return scene.ambient_scale;
    }
    var light = scene.ambient_scale;
    if HAS_DAYLIGHT_FIELD {
        light = field_scattered(w.origin, w.direction, line) + EMISSION_AHEAD * scene.largest_emission;
    }
    if HAS_AIR_LAMPS {
        light += air_lamps_scattered_about(w.origin, w.direction);
    }
    if end.kind == SURFACE && HAS_MEDIUM {
        light *= one_minus_exp(way_along(w.origin, w.direction, end.t, BY_ATTENUATION).depth);
    }
    return light;
}

/// Irradiance on a surface at `place` by everything but the sun's own beam.
fn diffuse_irradiance(in_air: bool, place: vec3f, point: SurfacePoint) -> Spectrum {
    if HAS_AIR_LAMPS {
        return daylight_irradiance(in_air, depth_of(place), point) + air_lamps_about(place, in_air);
    }
    return daylight_irradiance(in_air, depth_of(place), point);
}

fn daylight_irradiance(in_air: bool, depth_m: f32, point: SurfacePoint) -> Spectrum {
    if !HAS_DAYLIGHT_FIELD || in_air {
        return PI * scene.ambient_scale;
    }
    return field_irradiance(depth_m, point.shading_normal.z) + PI * EMISSION_AHEAD * scene.largest_emission;
}

/// Light from the surface at the end of a segment, attenuated on the way: what it emits and what it reflects.
fn light_on_surface(w: AmbientWalk, end: End, point: SurfacePoint) -> Spectrum {
    let place = w.origin + end.t * w.direction;
    let depth = depth_of(place);
    var irradiance = diffuse_irradiance(false, place, point);
    if HAS_SUN {
        let cosine = max(dot(point.shading_normal, scene.sun_towards), 0.0);
        irradiance += sun_irradiance() * cosine * transmittance_along(place, scene.sun_towards, depth / scene.sun_towards.z);
    }
    return transmittance_along(w.origin, w.direction, end.t) * (point.emission + surface_albedo(point) * irradiance / PI);
}
