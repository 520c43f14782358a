// Joining the last vertex of a walk to the lamps, by bridges and by what lies straight ahead.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::bridge::{add_segment, bridge, bridge_draw, bridge_straight, bridge_turn, bridge_vertex, extra_row, quarters_about};
import package::common::surface::SurfacePoint;
import package::common::film::add_light;
import package::common::gloss::{surface_factor, surface_pdf};
import package::common::interface::{distance_to_surface, flip, is_above};
import package::common::lamp_targets::{NO_NUMBER, Target, lamp_point, target_count, targets};
import package::common::lamp_walk::{unfolded, unfolded_direction, walk};
import package::common::layer_tables::BY_SCATTERING;
import package::common::layers::drawn_between;
import package::common::layout::{HAS_DISKS, HAS_GLOSS, HAS_LAYERS, HAS_SCATTERING, NONE, Spectrum, scratch};
import package::common::light::{lamp_facing_area, lamp_is_directed, lamp_radiance_along, lamp_relative_intensity};
import package::common::math::sin2_half;
import package::common::mis::{Connection, mis_contribution, subpath};
import package::common::order::{order_sample, order_sample_scattered};
import package::common::phase::phase_value;
import package::common::rng::uniform_number;
import package::common::spectrum::lamp_sigma;
import package::common::tables::{lamp_film_layer, lamp_intensity, lamp_level, lamp_radius};
import package::common::unfold::segment_factor;

/// Path vertices made by this lane, for the statistics.
var<private> vertex_count: u32;

/// Scattering function where the walk stands, in the water or on a surface, towards a real direction.
fn scattering_pdf_at(on_surface: bool, point: SurfacePoint, towards: vec3f) -> f32 {
    if on_surface {
        return surface_pdf(point, towards);
    }
    return phase_value(sin2_half(walk.direction, towards));
}

/// What light towards a real direction has beyond it: of the surface on which the walk stands.
fn factor_at(on_surface: bool, point: SurfacePoint, towards: vec3f) -> Spectrum {
    if HAS_GLOSS && on_surface {
        return surface_factor(point, towards);
    }
    return Spectrum(1.0);
}

/// Draws a bridge to `end`; false when its order is below `least` or above `most`, or it cannot be made.
fn draw_bridge(position: vec3f, end: vec3f, least: u32, most: u32, u: f32) -> bool {
    if !HAS_SCATTERING {
        return least == 0u && bridge_straight(position, end);
    }
    let depth = lamp_sigma()[walk.channels.chosen] * drawn_between(position, end, BY_SCATTERING);
    var order: u32;
    if least == 0u {
        order = order_sample(depth, u);
    } else {
        order = order_sample_scattered(depth, u);
    }
    if order == NONE || order < least || order > most {
        return false;
    }
    vertex_count += order;
    return bridge_draw(position, end, order);
}

/// Walks along the bridge; false where it is blocked. Fills the reflectances met per segment.
fn cross_bridge(start: vec3f, end: vec3f) -> bool {
    var previous = start;
    var start_primitive = walk.start_primitive;
    var i = 0u;
    loop {
        var next = end;
        if i < bridge.order {
            next = bridge_vertex(i).xyz;
        }
        let factor = segment_factor(previous, next, start_primitive);
        if HAS_LAYERS {
            add_segment(i, previous, next);
        }
        scratch[extra_row(i)].y = factor;
        bridge.crossing *= factor;
        previous = next;
        start_primitive = NONE;
        i += 1u;
        if i > bridge.order || factor == 0.0 {
            break;
        }
    }
    return bridge.crossing != 0.0;
}

/// Adds the light of the path that the bridge makes from `start` to the lamp point `end`, times `factor`.
fn send(aimed: Target, start: vec3f, end: vec3f, scattering_pdf: f32, factor: Spectrum) {
    let relative = emitted(aimed, bridge.emission);
    if relative == 0.0 || !cross_bridge(start, end) {
        return;
    }
    var facing = 0.0;
    if lamp_radius(aimed.lamp) > 0.0 {
        var last = start;
        if bridge.order > 0u {
            last = bridge_vertex(bridge.order - 1u).xyz;
        }
        // A walk cannot meet the lamp by chance across the water surface.
        if is_above(last) == is_above(end) {
            facing = lamp_facing_area(aimed.lamp, select(bridge.emission, flip(bridge.emission), aimed.mirrored));
        }
    }
    let radiance = mis_contribution(walk.channels, Connection(scattering_pdf, end, facing));
    let light = factor * relative * aimed.weight * lamp_intensity(aimed.lamp) * radiance;
    let scattered = walk.scatterings + bridge.order > 0u;
    add_light(lamp_film_layer(aimed.lamp), lamp_level(aimed.lamp), walk.met_surface, scattered, light);
}

/// Bridges from the walk's last vertex to every aimed; the order of the first by `number`, unless that is NO_NUMBER.
fn connect_lamps(on_surface: bool, point: SurfacePoint, max_events: u32, number: f32) {
    let position = unfolded(walk.origin);
    // The straight way from the first surface is not the walk's to count.
    let least = select(0u, 1u, walk.unscattered && walk.met_surface);
    let most = max_events - min(walk.events, max_events);
    if target_count == 0u {
        return;
    }
    var i = 0u;
    loop {
        connect_lamp(targets[i], on_surface, point, position, least, most, select(NO_NUMBER, number, i == 0u));
        i += 1u;
        if i >= target_count {
            break;
        }
    }
}

/// A bridge from the walk's last vertex, at `position`, to one target.
fn connect_lamp(aimed: Target, on_surface: bool, point: SurfacePoint, position: vec3f, least: u32, most: u32, number: f32) {
    var u = number;
    if number == NO_NUMBER {
        u = uniform_number();
    }
    let end = lamp_point(aimed);
    if !draw_bridge(position, end, least, most, u) {
        return;
    }
    let factor = turn_bridge(on_surface, point, aimed, position, end);
    if factor == 0.0 {
        return;
    }
    let scattering_pdf = scattering_pdf_at(on_surface, point, unfolded_direction(bridge.first));
    if scattering_pdf > 0.0 {
        send(aimed, position, end, scattering_pdf, factor * factor_at(on_surface, point, unfolded_direction(bridge.first)));
    }
}

/// Chooses the roll of a bridge that scatters, of four quarter turns, by the lamp's beam and, at a surface, the cosine.
/// Returns the factor for the choice; 0 where none is worth anything.
fn turn_bridge(on_surface: bool, point: SurfacePoint, aimed: Target, start: vec3f, end: vec3f) -> f32 {
    if bridge.order == 0u || !(on_surface || lamp_is_directed(aimed.lamp)) {
        return 1.0;
    }
    let axis = (end - start) / bridge.distance;
    var worths: vec4f;
    for (var turns = 0u; turns < 4u; turns++) {
        var scattering_pdf = 1.0;
        if on_surface {
            scattering_pdf = surface_pdf(point, unfolded_direction(quarters_about(bridge.first, axis, turns)));
        }
        worths[turns] = scattering_pdf * emitted(aimed, quarters_about(bridge.emission, axis, turns));
    }
    return bridge_turn(axis, uniform_number(), worths);
}

/// Relative intensity with which the target sends light along `emission`, a direction of unfolded space.
fn emitted(aimed: Target, emission: vec3f) -> f32 {
    return lamp_relative_intensity(aimed.lamp, select(emission, flip(emission), aimed.mirrored));
}

/// The aimed's disk when the walk's direction meets it: sent with `scattering_pdf`, the density of that direction.
fn meet_lamp(aimed: Target, scattering_pdf: f32) {
    if lamp_radius(aimed.lamp) == 0.0 || aimed.mirrored != walk.mirrored {
        return;
    }
    let to_boundary = distance_to_surface(walk.origin, walk.direction);
    let disk = lamp_radiance_along(aimed.lamp, walk.origin, walk.direction, to_boundary);
    if !disk.met {
        return;
    }
    let start = unfolded(walk.origin);
    let end = unfolded(walk.origin + disk.t * walk.direction);
    if bridge_straight(start, end) {
        send(aimed, start, end, scattering_pdf, Spectrum(1.0));
    }
}

/// Disk lamps that the walk's new direction meets: one more technique of making the path.
fn meet_lamps(scattering_pdf: f32) {
    if !HAS_DISKS || walk.unscattered || subpath.count == 0u || target_count == 0u {
        return;
    }
    var i = 0u;
    loop {
        meet_lamp(targets[i], scattering_pdf);
        i += 1u;
        if i >= target_count {
            break;
        }
    }
}
