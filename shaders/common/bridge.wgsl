// Similarity bridges: a walk with k scatterings, scaled and turned so that it joins two given points.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
//
// Vertices live in the scratch buffer, one column per lane: positions and segment lengths of the bridge as it was
// drawn, then positions and lengths of the camera subpath, then per place (sin²(θ/2), crossing) of the bridge and (pdf,
// reflected) of the subpath.
import package::common::film::lane;
import package::common::layout::{dispatch, scene, scratch};
import package::common::math::{circle, frame, minus_ln, turn};
import package::common::phase::phase_sample_x;
import package::common::rng::{next_bits, uniform_number};

/// Walks longer than the straight way by this optical depth are dropped.
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
}

var<private> bridge: Bridge;

fn bridge_place(i: u32) -> u32 {
    return i * dispatch.lanes + lane;
}

fn subpath_row(i: u32) -> u32 {
    return (dispatch.slots + i) * dispatch.lanes + lane;
}

fn extra_row(i: u32) -> u32 {
    return (2u * dispatch.slots + i) * dispatch.lanes + lane;
}

/// The bridge without scattering; false where the points coincide.
fn bridge_straight(start: vec3f, end: vec3f) -> bool {
    let offset = end - start;
    let distance = length(offset);
    if !(distance > 0.0) {
        return false;
    }
    let first = offset / distance;
    bridge = Bridge(0u, distance, distance, first, -first, start, mat3x3f(), 1.0, 1.0);
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
    var i = 0u;
    loop {
        let step = minus_ln(uniform_number());
        total += step;
        position += step * direction;
        if i < order {
            scratch[bridge_place(i)] = vec4f(position, step);
            let x = phase_sample_x(next_bits());
            scratch[extra_row(i)].x = x;
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
    if (walked - distance) * scene.c_min > MAX_EXCESS_DEPTH {
        return false;
    }
    bridge_fit(axis, position / extent, direction, scale);
    bridge.order = order;
    bridge.length = max(walked, distance);
    return true;
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
