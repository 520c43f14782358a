// Similarity bridges: a walk with k scatterings, scaled and turned so that it joins two given points.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
//
// Vertices live in the scratch buffer, one column per lane: positions and segment lengths of the bridge as it was
// drawn, then positions and lengths of the camera subpath, then per place (sin²(θ/2), crossing) of the bridge and (pdf,
// reflected) of the subpath; where the water varies also (drawn length of the subpath, that of the bridge's segment, ln of the
// relative scattering of the bridge's vertex, that of the subpath's).
//
// Where the water varies, scatterings lie at fractions of the bridge's length that are drawn as the straight way has them in
// blurred water, so that thin layers are met as often as they scatter (docs/transport.md).
import package::common::film::lane;
import package::common::layer_distance::distance_between;
import package::common::layer_tables::{BY_BRIDGE, BY_SCATTERING};
import package::common::layers::{drawn_between, way_between, water_at};
import package::common::layout::{HAS_LAYERS, Spectrum, dispatch, scene, scratch};
import package::common::math::{circle, frame, minus_ln, turn};
import package::common::phase::phase_sample_x;
import package::common::rng::{next_bits, uniform_number};

/// Bridges are dropped that hold less than e to minus this of the light of others of their order.
const MAX_EXCESS_DEPTH: f32 = 60.0;

struct Bridge {
    order: u32,
    distance: f32,
    length: f32,
    first: vec3f,
    emission: vec3f,
    /// Where the walk starts, the map from how it was drawn to how it lies, and the scale in that.
    start: vec3f,
    map: mat3x3f,
    scale: f32,
    /// Product of the reflectances met on its segments.
    crossing: f32,
    /// Drawn length of the straight way; where the water varies also the optical depth of the bridge, and the sum of the
    /// logarithms of the scattering coefficients at its vertices over the relative ones.
    drawn: f32,
    depth: Spectrum,
    ln_b: Spectrum,
}

var<private> bridge: Bridge;
/// Place at which bridges are drawn: behind one that is to be joined.
var<private> bridge_base: u32;

fn bridge_place(i: u32) -> u32 {
    return i * dispatch.lanes + lane;
}

fn subpath_row(i: u32) -> u32 {
    return (dispatch.slots + i) * dispatch.lanes + lane;
}

fn extra_row(i: u32) -> u32 {
    return (2u * dispatch.slots + i) * dispatch.lanes + lane;
}

fn drawn_row(i: u32) -> u32 {
    return (3u * dispatch.slots + i) * dispatch.lanes + lane;
}

/// The bridge without scattering; false where the points coincide.
fn bridge_straight(start: vec3f, end: vec3f) -> bool {
    let offset = end - start;
    let distance = length(offset);
    if !(distance > 0.0) {
        return false;
    }
    let first = offset / distance;
    let drawn = drawn_between(start, end, BY_SCATTERING);
    bridge = Bridge(0u, distance, distance, first, -first, start, mat3x3f(), 1.0, 1.0, drawn, Spectrum(0.0), Spectrum(0.0));
    return true;
}

/// Draws a bridge of `order` scatterings; false where it cannot be fitted or carries nothing.
fn bridge_draw(start: vec3f, end: vec3f, order: u32) -> bool {
    if !bridge_straight(start, end) || order == 0u {
        return bridge.distance > 0.0 && order == 0u;
    }
    let distance = bridge.distance;
    let axis = bridge.first;
    var position = vec3f(0.0);
    var direction = vec3f(0.0, 0.0, 1.0);
    var total = 0.0;
    if HAS_LAYERS {
        draw_fractions(start, end, order);
    }
    var i = 0u;
    loop {
        var step: f32;
        if HAS_LAYERS {
            var next = 1.0;
            if i < order {
                next = scratch[drawn_row(i)].z;
            }
            step = next - total;
        } else {
            step = minus_ln(uniform_number());
        }
        total += step;
        position += step * direction;
        // The last is where the bridge ends, for one that is drawn behind it.
        scratch[bridge_place(bridge_base + i)] = vec4f(position, step);
        if i < order {
            let x = phase_sample_x(next_bits());
            scratch[extra_row(bridge_base + i)].x = x;
            // The first azimuth is given by the roll about the axis when the walk is fitted.
            var azimuth = 0.0;
            if i > 0u {
                azimuth = uniform_number();
            }
            direction = turn(direction, x, azimuth);
        }
        i += 1u;
        if i > order {
            break;
        }
    }
    let extent = length(position);
    if !(extent > 1e-5 * total) {
        return false;
    }
    let scale = distance / extent;
    let walked = total * scale;
    if excess_depth(f32(order), walked, distance) > MAX_EXCESS_DEPTH {
        return false;
    }
    bridge_fit(axis, position / extent, direction, scale);
    bridge.order = order;
    bridge.length = max(walked, distance);
    return true;
}

/// How many times e less light a bridge of `order` scatterings holds at least for being `walked` m long: its light goes with s^order e^(-cs),
/// which is largest at order/c or, if that is farther, at the straight way.
fn excess_depth(order: f32, walked: f32, straight: f32) -> f32 {
    let best = max(straight * scene.c_min, order);
    let depth = max(walked * scene.c_min, best);
    return depth - best - order * log(depth / best);
}

/// Draws the fractions of the bridge's length at which it scatters, in increasing order.
fn draw_fractions(start: vec3f, end: vec3f, order: u32) {
    let whole = drawn_between(start, end, BY_BRIDGE);
    var i = 0u;
    loop {
        let u = clamp(distance_between(start, end, uniform_number() * whole) / bridge.distance, 0.0, 1.0);
        var at = i;
        loop {
            if at == 0u {
                break;
            }
            let before = scratch[drawn_row(at - 1u)].z;
            if before <= u {
                break;
            }
            scratch[drawn_row(at)].z = before;
            at -= 1u;
        }
        scratch[drawn_row(at)].z = u;
        i += 1u;
        if i >= order {
            break;
        }
    }
}

/// Where the water varies: adds the segment to `next` to the bridge's depth and, unless it is the last, the scattering at
/// its end.
fn add_segment(i: u32, previous: vec3f, next: vec3f) {
    let way = way_between(previous, next, BY_SCATTERING);
    bridge.depth += way.depth;
    scratch[drawn_row(i)].y = way.drawn;
    if i < bridge.order {
        let here = water_at(next, BY_SCATTERING);
        bridge.ln_b += here.ln_b;
        scratch[drawn_row(i)].z = log(here.relative);
    }
}

/// Scales by `scale` and turns so that the shape's unit axis `reach` becomes `axis`, with a uniform roll.
fn bridge_fit(axis: vec3f, reach: vec3f, last: vec3f, scale: f32) {
    let old = frame(reach);
    let new_frame = frame(axis);
    let roll = circle(uniform_number());
    let roll_u = roll.x * new_frame.u + roll.y * new_frame.v;
    let roll_v = roll.x * new_frame.v - roll.y * new_frame.u;
    let map = mat3x3f(
        reach.x * axis + old.u.x * roll_u + old.v.x * roll_v,
        reach.y * axis + old.u.y * roll_u + old.v.y * roll_v,
        reach.z * axis + old.u.z * roll_u + old.v.z * roll_v,
    );
    bridge.first = map[2];
    bridge.emission = -(map * last);
    bridge.map = scale * map;
    bridge.scale = scale;
}

/// Vertex `i`, one of the scatterings, and the length of the segment before it.
fn bridge_vertex(i: u32) -> vec4f {
    let drawn = scratch[bridge_place(i)];
    return vec4f(bridge.start + bridge.map * drawn.xyz, bridge.scale * drawn.w);
}

/// Writes the places of the bridge as they lie about `origin`, its end last.
fn bridge_settle(origin: vec3f) {
    let base = bridge_base;
    if bridge.order == 0u {
        scratch[bridge_place(base)] = vec4f(bridge.start + bridge.distance * bridge.first - origin, bridge.distance);
        return;
    }
    let start = bridge.start - origin;
    var i = 0u;
    loop {
        let drawn = scratch[bridge_place(base + i)];
        scratch[bridge_place(base + i)] = vec4f(start + bridge.map * drawn.xyz, bridge.scale * drawn.w);
        i += 1u;
        if i > bridge.order {
            break;
        }
    }
}

/// Joins the bridge to `end`, drawn behind `head` from its end, to that: one whose vertex there turns as x = sin²(θ/2) says. Both are to be settled.
fn bridge_join(head: Bridge, x: f32, end: vec3f) {
    scratch[extra_row(head.order)].x = x;
    bridge.order += head.order + 1u;
    bridge.start = head.start;
    bridge.first = head.first;
    bridge.distance = distance(head.start, end);
    bridge.drawn = bridge.distance;
    bridge.length = max(head.length + bridge.length, bridge.distance);
    bridge.map = mat3x3f(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), vec3f(0.0, 0.0, 1.0));
    bridge.scale = 1.0;
    bridge_base = 0u;
}

/// Turns the bridge about the straight way by that of four quarter turns which `u` picks in proportion to `worths`.
/// Returns the mean worth over its own; 0 where all are worth nothing.
fn bridge_turn(axis: vec3f, u: f32, worths: vec4f) -> f32 {
    let sum = dot(worths, vec4f(1.0));
    if !(sum > 0.0) {
        return 0.0;
    }
    var turns = 0u;
    var left = u * sum - worths.x;
    while left >= 0.0 && turns < 3u {
        turns += 1u;
        left -= worths[turns];
    }
    if worths[turns] == 0.0 {
        return 0.0;
    }
    bridge.first = quarters_about(bridge.first, axis, turns);
    bridge.emission = quarters_about(bridge.emission, axis, turns);
    let map = bridge.map;
    bridge.map = mat3x3f(
        quarters_about(map[0], axis, turns),
        quarters_about(map[1], axis, turns),
        quarters_about(map[2], axis, turns),
    );
    return 0.25 * sum / worths[turns];
}

/// `v` turned about the unit vector `axis` by 0 to 3 right angles.
fn quarters_about(v: vec3f, axis: vec3f, turns: u32) -> vec3f {
    let along = dot(v, axis) * axis;
    let across = select(v - along, cross(axis, v), (turns & 1u) == 1u);
    return along + select(across, -across, turns >= 2u);
}
