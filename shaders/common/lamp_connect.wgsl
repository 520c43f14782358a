// Joining the last vertex of a walk to the lamps, by bridges and by what lies straight ahead.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::bridge::{add_segment, bridge, bridge_base, bridge_draw, bridge_join, bridge_settle, bridge_straight, bridge_turn, bridge_vertex, extra_row, quarters_about};
import package::common::camera::end_point;
import package::common::surface::SurfacePoint;
import package::common::film::add_light;
import package::common::gloss::{surface_factor, surface_pdf};
import package::common::interface::{distance_to_surface, flip, is_above};
import package::common::lamp_beam::{Beam, beam_beside, beam_point, led_beam};
import package::common::lamp_spot::{arrival_shares, draw_spot, lit_ground, lit_spot, share_of_bridges, spot_cosine, spot_reflects};
import package::common::lamp_targets::{NO_NUMBER, Target, lamp_point, target_centre, target_count, targets};
import package::common::lamp_walk::{unfolded, unfolded_direction, walk};
import package::common::layer_tables::BY_SCATTERING;
import package::common::layers::drawn_between;
import package::common::layout::{HAS_BEAMS, HAS_DISKS, HAS_GLOSS, HAS_LAYERS, HAS_SCATTERING, HAS_SURFACE, NONE, Spectrum, scratch};
import package::common::light::{lamp_facing_area, lamp_is_directed, lamp_radiance_along, lamp_relative_intensity};
import package::common::math::sin2_half;
import package::common::mis::{Connection, Stretch, contribution_by_spot, mis_contribution};
import package::common::order::{order_sample, order_sample_scattered};
import package::common::phase::phase_value;
import package::common::rng::uniform_number;
import package::common::settings::largest_order;
import package::common::spectrum::lamp_sigma;
import package::common::subpath::{most_from, subpath};
import package::common::tables::{lamp_film_layer, lamp_intensity, lamp_level, lamp_radius};
import package::common::unfold::segment_factor;

/// Ways to a lamp: by one bridge, or by two, by way of a scattering in the beam or of the spot.
const STRAIGHT: u32 = 0u;
const THROUGH_BEAM: u32 = 1u;
const TO_SPOT: u32 = 2u;

/// How a way is led to a point `end` of target `index`, and the beam through which or to whose spot ways are led.
struct Lead {
    kind: u32,
    index: u32,
    end: vec3f,
    beam: Beam,
}

/// The place by way of which two bridges are led, and the direction in which the first comes there.
var<private> middle_point: vec3f;
var<private> middle_direction: vec3f;
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

/// Walks along the bridge; false where it is blocked. Fills the reflectances met per segment. Vertex `spot` lies on a surface; NONE: none does.
fn cross_bridge(start: vec3f, end: vec3f, spot: u32) -> bool {
    var previous = start;
    var start_primitive = walk.start_primitive;
    var i = 0u;
    loop {
        var next = end;
        if i < bridge.order {
            next = bridge_vertex(i).xyz;
        }
        // The way to a surface is looked along from there, so that rounding does not let the surface itself block it.
        let lands = HAS_BEAMS && i == spot;
        if lands {
            start_primitive = lit_spot.end.primitive;
        }
        let factor = segment_factor(select(previous, next, lands), select(next, previous, lands), start_primitive);
        if HAS_LAYERS {
            add_segment(i, previous, next);
        }
        scratch[extra_row(i)].y = factor;
        bridge.crossing *= factor;
        previous = next;
        start_primitive = select(NONE, start_primitive, lands);
        i += 1u;
        if i > bridge.order || factor == 0.0 {
            break;
        }
    }
    return bridge.crossing != 0.0;
}

/// Adds the light of the path that the bridge makes from `start` to where `lead` ends, times `factor`; two bridges by way of vertex `middle`.
fn send(aimed: Target, start: vec3f, lead: Lead, scattering_pdf: f32, factor: Spectrum, middle: u32) {
    let by_spot = HAS_BEAMS && lead.kind == TO_SPOT;
    var sent = factor * emitted(aimed, bridge.emission);
    let end = lead.end;
    if all(sent == Spectrum(0.0)) || !cross_bridge(start, end, select(NONE, middle, by_spot)) {
        return;
    }
    var radiance: Spectrum;
    if by_spot {
        radiance = radiance_by_spot(end, scattering_pdf, middle);
    } else {
        if HAS_BEAMS && walk.met_surface {
            sent *= arrival_shares[lead.index];
        }
        radiance = mis_contribution(walk.channels, Connection(scattering_pdf, end, facing_area(aimed, start, end), lead.beam, middle));
    }
    let light = sent * aimed.weight * lamp_intensity(aimed.lamp) * radiance;
    let scattered = walk.scatterings + bridge.order > 0u;
    add_light(lamp_film_layer(aimed.lamp), lamp_level(aimed.lamp), walk.met_surface || by_spot, scattered, light);
}

/// Area of the lamp as it is seen from the end of the bridge from `start`, where a walk can meet it by chance.
fn facing_area(aimed: Target, start: vec3f, end: vec3f) -> f32 {
    if lamp_radius(aimed.lamp) == 0.0 {
        return 0.0;
    }
    var last = start;
    if bridge.order > 0u {
        last = bridge_vertex(bridge.order - 1u).xyz;
    }
    // Across the water surface it cannot.
    if is_above(last) != is_above(end) {
        return 0.0;
    }
    return lamp_facing_area(aimed.lamp, select(bridge.emission, flip(bridge.emission), aimed.mirrored));
}

/// Bridges from the walk's last vertex to every target and, where they are led to beams, through those and to their spots; the order of the first
/// by `number`, unless that is NO_NUMBER.
fn connect_lamps(on_surface: bool, is_start: bool, point: SurfacePoint, max_events: u32, number: f32) {
    let position = unfolded(walk.origin);
    // The straight way from the first surface is not the walk's to count.
    let least = select(0u, 1u, walk.unscattered && walk.met_surface);
    let most = min(max_events - min(walk.events, max_events), most_from(subpath.count - min(subpath.count, 1u)));
    if target_count == 0u {
        return;
    }
    let last_kind = select(STRAIGHT, TO_SPOT, is_start);
    var i = 0u;
    var kind = STRAIGHT;
    loop {
        connect_lamp(i, kind, on_surface, point, position, least, most, select(NO_NUMBER, number, i == 0u && kind == STRAIGHT));
        i += 1u;
        if i >= target_count {
            i = 0u;
            kind += 1u;
        }
        if kind > last_kind {
            break;
        }
    }
}

/// A way from the walk's last vertex, at `position`, to one target, by one bridge or by two.
fn connect_lamp(index: u32, kind: u32, on_surface: bool, point: SurfacePoint, position: vec3f, least: u32, most: u32, number: f32) {
    let aimed = targets[index];
    var u = number;
    if u == NO_NUMBER {
        u = uniform_number();
    }
    let end = lamp_point(aimed);
    let lead = Lead(kind, index, end, beam_for(aimed, kind, position, end));
    let straight = !HAS_BEAMS || kind == STRAIGHT;
    var to = end;
    var fewest = least;
    var more = most;
    if !straight {
        more = min(most, largest_order());
        if more == 0u || !draw_middle(lead, aimed) {
            return;
        }
        // One more event is the scattering in the beam, or the surface in the spot.
        more -= 1u;
        to = middle_point;
        fewest = select(0u, 1u, kind == TO_SPOT && on_surface);
    }
    var factor = 1.0;
    var start = position;
    var head = bridge;
    bridge_base = 0u;
    loop {
        if !draw_bridge(start, to, fewest, more, u) {
            return;
        }
        factor *= turn_bridge(on_surface, point, aimed, start, to, lead);
        if factor == 0.0 {
            return;
        }
        if straight || bridge_base > 0u {
            break;
        }
        bridge_settle(position);
        head = bridge;
        arrive_at_middle(kind);
        bridge_base = head.order + 1u;
        more -= head.order;
        fewest = 0u;
        start = to;
        to = end;
        u = uniform_number();
    }
    var sent = Spectrum(factor);
    var middle = NONE;
    if !straight {
        middle = head.order;
        if kind == TO_SPOT {
            sent *= spot_reflects(head.emission, bridge.first);
        }
        let x = sin2_half(-head.emission, bridge.first);
        bridge_settle(position);
        bridge_join(head, x, end);
    }
    let first = unfolded_direction(bridge.first);
    let scattering_pdf = scattering_pdf_at(on_surface, point, first);
    if scattering_pdf > 0.0 {
        send(aimed, position, lead, scattering_pdf, sent * factor_at(on_surface, point, first), middle);
    }
}

/// The beam by way of which ways to a point `end` of the target are led.
fn beam_for(aimed: Target, kind: u32, position: vec3f, end: vec3f) -> Beam {
    if HAS_BEAMS && kind == TO_SPOT {
        return beam_beside(aimed, target_centre(aimed), position);
    }
    return led_beam(aimed, end);
}

/// Draws the place by way of which two bridges are led, `middle_point`; false where there is none.
fn draw_middle(lead: Lead, aimed: Target) -> bool {
    if lead.kind == TO_SPOT {
        if !lead.beam.is_beside || (HAS_SURFACE && aimed.mirrored) || !draw_spot(lead.beam) {
            return false;
        }
        middle_point = lit_spot.position;
        return true;
    }
    if !lead.beam.is_led {
        return false;
    }
    middle_point = beam_point(lead.beam);
    return true;
}

/// The first of two bridges ends.
fn arrive_at_middle(kind: u32) {
    middle_direction = -bridge.emission;
    if kind == TO_SPOT {
        lit_ground = end_point(lit_spot.end, middle_direction);
    }
}

/// Radiance of the two bridges by way of a spot that were joined at vertex `middle` and lead to `end`.
fn radiance_by_spot(end: vec3f, scattering_pdf: f32, middle: u32) -> Spectrum {
    var length_to = 0.0;
    var reflected = 1.0;
    var i = 0u;
    loop {
        length_to += bridge_vertex(i).w;
        reflected *= scratch[extra_row(i)].y;
        i += 1u;
        if i > middle {
            break;
        }
    }
    let there = lit_spot.position - bridge.start;
    let onwards = end - lit_spot.position;
    let to_spot = Stretch(middle, length_to, dot(there, there));
    let to_lamp = Stretch(bridge.order - 1u - middle, bridge.length - length_to, dot(onwards, onwards));
    let from_surface = walk.start_primitive != NONE;
    let share = share_of_bridges(from_surface, to_spot, -middle_direction, reflected, scattering_pdf);
    return share * contribution_by_spot(walk.channels, scattering_pdf, from_surface, to_spot, to_lamp);
}

/// Chooses the roll of a bridge to `to` that scatters, of four quarter turns: by what scatters or reflects at its ends, as far as that is known, and
/// what the lamp sends along it. Returns the factor for the choice; 0 where none is worth anything.
fn turn_bridge(on_surface: bool, point: SurfacePoint, aimed: Target, start: vec3f, to: vec3f, lead: Lead) -> f32 {
    let is_second = HAS_BEAMS && bridge_base > 0u;
    if !HAS_SCATTERING || bridge.order == 0u || !(is_second || on_surface || lamp_is_directed(aimed.lamp)) {
        return 1.0;
    }
    let axis = (to - start) / bridge.distance;
    let to_middle = HAS_BEAMS && lead.kind != STRAIGHT && !is_second;
    let onwards = normalize(select(axis, lead.end - to, to_middle && any(lead.end != to)));
    var worths: vec4f;
    for (var turns = 0u; turns < 4u; turns++) {
        let first = quarters_about(bridge.first, axis, turns);
        let emission = quarters_about(bridge.emission, axis, turns);
        var worth = 1.0;
        if is_second && lead.kind == THROUGH_BEAM {
            worth = phase_value(sin2_half(middle_direction, first));
        } else if is_second {
            worth = surface_pdf(lit_ground, first);
        } else if on_surface {
            worth = surface_pdf(point, unfolded_direction(first));
        }
        if !to_middle {
            worth *= emitted(aimed, emission);
        } else if lead.kind == THROUGH_BEAM {
            worth *= phase_value(sin2_half(-emission, onwards));
        } else {
            worth *= spot_cosine(emission);
        }
        worths[turns] = worth;
    }
    return bridge_turn(axis, uniform_number(), worths);
}

/// Relative intensity with which the target sends light along `emission`, a direction of unfolded space.
fn emitted(aimed: Target, emission: vec3f) -> f32 {
    return lamp_relative_intensity(aimed.lamp, select(emission, flip(emission), aimed.mirrored));
}

/// The aimed's disk when the walk's direction meets it: sent with `scattering_pdf`, the density of that direction.
fn meet_lamp(index: u32, scattering_pdf: f32) {
    let aimed = targets[index];
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
        send(aimed, start, Lead(STRAIGHT, index, end, led_beam(aimed, end)), scattering_pdf, Spectrum(1.0), NONE);
    }
}

/// Disk lamps that the walk's new direction meets: one more technique of making the path.
fn meet_lamps(scattering_pdf: f32) {
    if !HAS_DISKS || walk.unscattered || subpath.count == 0u || target_count == 0u {
        return;
    }
    var i = 0u;
    loop {
        meet_lamp(i, scattering_pdf);
        i += 1u;
        if i >= target_count {
            break;
        }
    }
}
