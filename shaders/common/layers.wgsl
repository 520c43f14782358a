// Water that varies: coefficients are straight lines in depth between the nodes of a profile, the same beyond its ends,
// and Gaussian clouds on top. Depths along a straight way are in closed form.
//
// What walks are drawn with varies alike in all channels: the coefficient of a strategy times a relative number, by
// scattering (walks that are joined to lamps) or by attenuation (walks that look for daylight), 1 where the water is as the
// scene's own record says. The integral of that along a way is the way's drawn length: where the water is the same
// everywhere it is the length itself. A third number, scattering blurred by some decimetres, places the scatterings of
// bridges; it has nodes of its own.
// Host: crates/render/src/prepare/layers.rs (makes the rows). Checked by: tests/system/ (varying_water, layered_water).
import package::common::interface::{is_above, mirror};
import package::common::layer_tables::{BY_ATTENUATION, layer_coefficient, layer_node, lower_node, node_count_by, nodes_above, number_between, plume_row, share_between, signed_depth, upper_node};
import package::common::layout::{HAS_LAYERS, HAS_PLUMES, HAS_SURFACE, Spectrum, scene};
import package::common::plumes::{drawn_in_plumes, length_in_plume, number_of_plumes, plume_share};
import package::common::settings::{layer_count, plume_count};
import package::common::spectrum::{water_b, water_c, water_ln_b};

/// Optical depth and drawn length of a way.
struct Way {
    depth: Spectrum,
    drawn: f32,
}

/// Water at a point: scattering, ln of the coefficient over the relative number, and that number.
struct LocalWater {
    b: Spectrum,
    ln_b: Spectrum,
    relative: f32,
}

/// A way through the layers by depth: where it is highest and lowest, m, and its length.
struct Descent {
    low: f32,
    high: f32,
    length: f32,
}

fn descent(origin: vec3f, direction: vec3f, length: f32) -> Descent {
    let start = signed_depth(origin);
    let end = start - direction.z * length;
    return Descent(min(start, end), max(start, end), length);
}

/// Length of the part of a way between two depths.
fn part_of(d: Descent, begin: f32, to: f32) -> f32 {
    return select(d.length * ((to - begin) / (d.high - d.low)), d.length, begin == d.low && to == d.high);
}

/// Drawn length of a way without the clouds.
fn drawn_in_layers(d: Descent, by: u32) -> f32 {
    let count = node_count_by(by);
    var above = nodes_above(d.low, by);
    var upper = layer_node(upper_node(above), by);
    var sum = 0.0;
    var begin = d.low;
    loop {
        let lower = layer_node(min(above, count - 1u), by);
        let to = select(d.high, min(lower.x, d.high), above < count);
        sum += part_of(d, begin, to) * number_between(upper, lower, 0.5 * (begin + to));
        begin = to;
        upper = lower;
        above += 1u;
        if to >= d.high {
            break;
        }
    }
    return sum;
}

/// A way without the clouds.
fn way_in_layers(d: Descent, by: u32) -> Way {
    var above = nodes_above(d.low, by);
    var upper = layer_node(upper_node(above), by);
    var upper_c = layer_coefficient(upper_node(above), 0u);
    var sum = Way(Spectrum(0.0), 0.0);
    var begin = d.low;
    loop {
        let i = lower_node(above, by);
        let lower = layer_node(i, by);
        let lower_c = layer_coefficient(i, 0u);
        let to = select(d.high, min(lower.x, d.high), above < layer_count());
        let part = part_of(d, begin, to);
        let share = share_between(upper.x, lower.x, 0.5 * (begin + to));
        sum.depth += part * mix(upper_c, lower_c, share);
        sum.drawn += part * mix(upper.y, lower.y, share);
        begin = to;
        upper = lower;
        upper_c = lower_c;
        above += 1u;
        if to >= d.high {
            break;
        }
    }
    return sum;
}

/// Drawn length of the straight way from a point in the water, of `length` m.
fn drawn_along(origin: vec3f, direction: vec3f, length: f32, by: u32) -> f32 {
    if !HAS_LAYERS {
        return length;
    }
    return layered_drawn(origin, direction, length, by);
}

// What varies stands in functions of its own, so that compilers put the rest where it is called.
fn layered_drawn(origin: vec3f, direction: vec3f, length: f32, by: u32) -> f32 {
    return drawn_in_layers(descent(origin, direction, length), by) + drawn_in_plumes(origin, direction, length, by);
}

/// The straight way from a point in the water, of `length` m, drawn by scattering or by attenuation.
fn way_along(origin: vec3f, direction: vec3f, length: f32, by: u32) -> Way {
    if !HAS_LAYERS {
        return Way(water_c() * length, length);
    }
    return layered_way(origin, direction, length, by);
}

fn layered_way(origin: vec3f, direction: vec3f, length: f32, by: u32) -> Way {
    var way = way_in_layers(descent(origin, direction, length), by);
    if !HAS_PLUMES {
        return way;
    }
    for (var i = 0u; i < plume_count(); i++) {
        let place = plume_row(i, 0u);
        let counted = length_in_plume(place.xyz, place.w, origin, direction, length);
        if counted > 0.0 {
            let numbers = plume_row(i, 1u);
            way.depth += counted * layer_coefficient(layer_count() + i, 0u);
            way.drawn += counted * select(numbers.x, numbers.y, by == BY_ATTENUATION);
        }
    }
    return way;
}

/// A straight way of unfolded space in two parts, each of which is folded below the surface; the second may have no length. What is asked
/// of both is asked in a loop: drivers put all functions into one, and what is called twice stands there twice.
struct FoldedWay {
    origin: vec3f,
    direction: vec3f,
    first: f32,
    crossing: vec3f,
    onward: vec3f,
    second: f32,
}

fn folded_way(start: vec3f, end: vec3f) -> FoldedWay {
    let offset = end - start;
    let length = length(offset);
    let direction = offset / max(length, 1e-30);
    let start_above = is_above(start);
    let end_above = is_above(end);
    var first = length;
    if start_above != end_above {
        first = clamp((scene.surface_height_m - start.z) / direction.z, 0.0, length);
    }
    return FoldedWay(
        below(start, start_above),
        turned_below(direction, start_above),
        first,
        below(start + first * direction, end_above),
        turned_below(direction, end_above),
        length - first,
    );
}

/// The second part of a way as a way of one.
fn second_part(f: FoldedWay) -> FoldedWay {
    return FoldedWay(f.crossing, f.onward, f.second, f.crossing, f.onward, 0.0);
}

/// The straight way between two points of unfolded space, drawn by scattering or by attenuation.
fn way_between(start: vec3f, end: vec3f, by: u32) -> Way {
    if !HAS_LAYERS {
        let length = distance(start, end);
        return Way(water_c() * length, length);
    }
    return layered_way_between(start, end, by);
}

fn layered_way_between(start: vec3f, end: vec3f, by: u32) -> Way {
    var f = folded_way(start, end);
    var way = Way(Spectrum(0.0), 0.0);
    loop {
        let part = way_along(f.origin, f.direction, f.first, by);
        way = Way(way.depth + part.depth, way.drawn + part.drawn);
        if !HAS_SURFACE || !(f.second > 0.0) {
            break;
        }
        f = second_part(f);
    }
    return way;
}

/// Its drawn length alone.
fn drawn_between(start: vec3f, end: vec3f, by: u32) -> f32 {
    if !HAS_LAYERS {
        return distance(start, end);
    }
    return layered_drawn_between(start, end, by);
}

fn layered_drawn_between(start: vec3f, end: vec3f, by: u32) -> f32 {
    var f = folded_way(start, end);
    var drawn = 0.0;
    loop {
        drawn += drawn_along(f.origin, f.direction, f.first, by);
        if !HAS_SURFACE || !(f.second > 0.0) {
            break;
        }
        f = second_part(f);
    }
    return drawn;
}

fn below(point: vec3f, above: bool) -> vec3f {
    if HAS_SURFACE && above {
        return mirror(point);
    }
    return point;
}

fn turned_below(direction: vec3f, above: bool) -> vec3f {
    return vec3f(direction.xy, select(direction.z, -direction.z, above));
}

/// The relative number at a point of unfolded space.
fn relative_at(point: vec3f, by: u32) -> f32 {
    let place = below(point, is_above(point));
    let depth_m = signed_depth(place);
    let above = nodes_above(depth_m, by);
    let number = number_between(layer_node(upper_node(above), by), layer_node(lower_node(above, by), by), depth_m);
    return number + number_of_plumes(place, by);
}

/// The water at a point of unfolded space, relative by scattering or by attenuation.
fn water_at(point: vec3f, by: u32) -> LocalWater {
    if !HAS_LAYERS {
        return LocalWater(water_b(), water_ln_b(), 1.0);
    }
    return layered_water(point, by);
}

fn layered_water(point: vec3f, by: u32) -> LocalWater {
    let place = below(point, is_above(point));
    let depth_m = signed_depth(place);
    let above = nodes_above(depth_m, by);
    let i = upper_node(above);
    let j = lower_node(above, by);
    let upper = layer_node(i, by);
    let lower = layer_node(j, by);
    let share = share_between(upper.x, lower.x, depth_m);
    var relative = mix(upper.y, lower.y, share);
    var b = mix(layer_coefficient(i, 1u), layer_coefficient(j, 1u), share);
    if HAS_PLUMES {
        for (var k = 0u; k < plume_count(); k++) {
            let plume = plume_row(k, 0u);
            let numbers = plume_row(k, 1u);
            let dense = plume_share(plume.xyz, plume.w, place);
            relative += dense * select(numbers.x, numbers.y, by == BY_ATTENUATION);
            b += dense * layer_coefficient(layer_count() + k, 1u);
        }
    }
    let ln_b = select(Spectrum(-1e30), log(max(b, Spectrum(1e-37))) - Spectrum(log(relative)), b > Spectrum(0.0));
    return LocalWater(b, ln_b, relative);
}
