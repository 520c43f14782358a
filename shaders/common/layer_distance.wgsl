// How far a way goes until it has a drawn length, in water that varies: in closed form in each straight part of a profile, by
// Newton's method among clouds.
// Checked by: tests/system/ (varying_water, layered_water).
import package::common::layer_tables::{BY_BRIDGE, layer_node, lower_node, node_count_by, nodes_above, number_between, signed_depth, upper_node};
import package::common::layers::{drawn_along, folded_way, second_part};
import package::common::layout::{HAS_LAYERS, HAS_PLUMES, HAS_SURFACE};
import package::common::plumes::{drawn_in_plumes, number_of_plumes};

/// Steps of Newton's method, safeguarded by halving, and the relative change below which a distance is there.
const STEPS: u32 = 48u;
const NEAR: f32 = 1e-6;

/// A part of a way on which layers are a straight line: from where, how long; the number at its start and what a metre
/// adds; and how much of the drawn length it is to have.
struct StraightPart {
    begin: f32,
    length: f32,
    number: f32,
    rise: f32,
    wanted: f32,
}

/// The distance along a way in the water at which its drawn length is `wanted`; `length` where it is not by then.
fn distance_of(origin: vec3f, direction: vec3f, length: f32, wanted: f32, by: u32) -> f32 {
    if !HAS_LAYERS {
        return min(wanted, length);
    }
    return layered_distance(origin, direction, length, wanted, by);
}

fn layered_distance(origin: vec3f, direction: vec3f, length: f32, wanted: f32, by: u32) -> f32 {
    let start = signed_depth(origin);
    let rate = -direction.z;
    let count = node_count_by(by);
    var part = StraightPart(0.0, 0.0, 0.0, 0.0, wanted);
    var reached = false;
    // Stretch after stretch until the one in which the distance is.
    var above = nodes_above(start, by);
    loop {
        let upper = layer_node(upper_node(above), by);
        let lower = layer_node(lower_node(above, by), by);
        var to = length;
        if rate > 0.0 && above < count {
            to = clamp((lower.x - start) / rate, part.begin, length);
        } else if rate < 0.0 && above > 0u {
            to = clamp((upper.x - start) / rate, part.begin, length);
        }
        part.length = to - part.begin;
        part.number = number_between(upper, lower, start + rate * part.begin);
        let there = number_between(upper, lower, start + rate * to);
        part.rise = (there - part.number) / max(part.length, 1e-30);
        var drawn = 0.5 * (part.number + there) * part.length;
        if HAS_PLUMES {
            drawn += drawn_in_plumes(origin + part.begin * direction, direction, part.length, by);
        }
        reached = drawn >= part.wanted;
        if reached || to >= length {
            break;
        }
        part.wanted -= drawn;
        part.begin = to;
        above = select(above - 1u, above + 1u, rate > 0.0);
    }
    if !reached {
        return length;
    }
    var t = min(distance_in_layers(part), part.length);
    if HAS_PLUMES {
        t = distance_among_plumes(part, origin + part.begin * direction, direction, t, by);
    }
    return part.begin + t;
}

/// The distance within a straight part, without clouds.
fn distance_in_layers(part: StraightPart) -> f32 {
    let square = part.number * part.number + 2.0 * part.rise * part.wanted;
    return 2.0 * part.wanted / max(part.number + sqrt(max(square, 0.0)), 1e-30);
}

/// The same with clouds, which only add, from the distance without.
fn distance_among_plumes(part: StraightPart, origin: vec3f, direction: vec3f, without: f32, by: u32) -> f32 {
    var low = 0.0;
    var high = without;
    var t = without;
    var before = t;
    for (var i = 0u; i < STEPS; i++) {
        let drawn = (part.number + 0.5 * part.rise * t) * t + drawn_in_plumes(origin, direction, t, by);
        let too_far = drawn - part.wanted;
        if too_far > 0.0 {
            high = t;
        } else {
            low = t;
        }
        let slope = max(part.number + part.rise * t + number_of_plumes(origin + t * direction, by), 1e-30);
        // A step must be less than half of the one before it, or the bracket is halved.
        let next = t - too_far / slope;
        let quick = next > low && next < high && 2.0 * abs(too_far) < before * slope;
        let step = select(0.5 * (low + high), next, quick) - t;
        before = abs(step);
        t += step;
        if abs(step) <= NEAR * t {
            break;
        }
    }
    return t;
}

/// Distance from `start` along the straight way to `end`, of unfolded space, at which its number for bridges is `wanted`.
fn distance_between(start: vec3f, end: vec3f, wanted: f32) -> f32 {
    var f = folded_way(start, end);
    var left = wanted;
    var before = 0.0;
    var t = 0.0;
    loop {
        t = distance_of(f.origin, f.direction, f.first, left, BY_BRIDGE);
        if !HAS_SURFACE || f.second == 0.0 || t < f.first {
            break;
        }
        left = max(left - drawn_along(f.origin, f.direction, f.first, BY_BRIDGE), 0.0);
        before = f.first;
        f = second_part(f);
    }
    return before + t;
}
