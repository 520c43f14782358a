// Multiple importance sampling: the techniques by which one path to a lamp can be made, combined by the balance
// heuristic (Veach and Guibas 1995).
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::bridge::{bridge, bridge_vertex, drawn_row, extra_row};
import package::common::lamp_beam::{Beam, beam_pdf, is_in_beam};
import package::common::layer_tables::BY_SCATTERING;
import package::common::layers::drawn_between;
import package::common::layout::{HAS_BEAMS, HAS_LAYERS, HAS_SCATTERING, NONE, Spectrum, scratch};
import package::common::math::ln_1p;
import package::common::medium::{LN_ZERO, ChannelSampling, channels_weight, largest, transmittance, used};
import package::common::order::{LN_POISSON_SHARE, order_ln_tail, scattered_share};
import package::common::phase::phase_value;
import package::common::settings::{lamp_strategies, largest_order};
import package::common::spectrum::{lamp_ln_sigma, lamp_sigma, water_c, water_ln_b};
import package::common::subpath::{BridgeStart, FREE_VERTICES, LEAST_LENGTH, PathToLamp, bridge_start, drawn_up_to, is_joined, late_order, most_from, path, subpath, turn_row, vertex_row};

/// How a path goes on from the last vertex of the walk.
struct Connection {
    scattering_pdf: f32,
    lamp: vec3f,
    /// Area of the lamp as it is seen from the way to it, if the walk can meet it by chance, m².
    facing: f32,
    /// The lamp's beam, as bridges are led through it from the start of the subpath.
    beam: Beam,
    /// The bridge's vertex by way of which it was led; NONE: by none.
    middle: u32,
}

/// A way of `order` scatterings.
struct Stretch {
    order: u32,
    length: f32,
    distance2: f32,
}

/// A way from a scattering or a surface to a surface that a beam lights.
struct WayToSpot {
    from_surface: bool,
    stretch: Stretch,
    /// Density of its first direction.
    scattering_pdf: f32,
    /// Product of the reflectances of the water surface on it.
    reflected: f32,
    /// Reciprocal of the density of points in the spot, as the way sees that, m².
    facing: f32,
}

struct LnDensities {
    poisson: Spectrum,
    tail: Spectrum,
}

/// The two parts of a technique's density under each strategy, in logarithms, without the factor D²/f.
fn ln_densities(start: BridgeStart, order: u32, root: bool) -> LnDensities {
    let distance = sqrt(start.distance2);
    let ahead = start.length - path.last_length;
    // No path is shorter than the straight one; rounding must not say so.
    let to_lamp = max(path.remaining - ahead, distance);
    let steps = f32(order + 1u);
    let ln_ratio = ln_1p((distance - to_lamp) / to_lamp);
    let ln_poisson = LN_POISSON_SHARE + steps * ln_ratio;
    var ln_tail = order_ln_tail(order) + ln_ratio - f32(order) * log(to_lamp);
    if HAS_LAYERS {
        ln_tail += f32(order) * log(max(distance, LEAST_LENGTH) / start.drawn_to_lamp);
    }
    let ln_walk = select(path.ln_walk_density, path.ln_root_density, root);
    let sigma = lamp_sigma();
    let common_part = ln_walk - sigma * (start.drawn - path.last_drawn) + Spectrum(start.ln_places);
    return LnDensities(
        common_part + Spectrum(ln_poisson) - sigma * start.drawn_to_lamp + path.more * lamp_ln_sigma(),
        common_part + Spectrum(ln_tail) + (path.more - f32(order)) * lamp_ln_sigma(),
    );
}

/// Exponentials of the strategies in use, summed.
fn sum_exp(ln: Spectrum) -> f32 {
    let e = exp(clamp(used(ln, max(lamp_strategies(), 1u)), Spectrum(-200.0), Spectrum(80.0)));
    return e.x + e.y + e.z;
}

/// Sum over the strategies of the density of a technique, relative to e^shift.
fn technique_density(start: BridgeStart, order: u32, root: bool, scattering_pdf: f32) -> f32 {
    let ln = ln_densities(start, order, root);
    let sum = sum_exp(ln.poisson - Spectrum(path.shift)) + sum_exp(ln.tail - Spectrum(path.shift));
    return min(sum * start.distance2 / max(scattering_pdf, 1e-35), 1e36);
}

/// Density of a walk that makes all vertices, the last at drawn length `drawn`, and then meets the lamp by chance.
fn hit_density(drawn: f32, facing: f32) -> f32 {
    if facing == 0.0 {
        return 0.0;
    }
    let ahead = drawn - path.last_drawn;
    return facing * sum_exp(path.ln_walk_density + path.more * lamp_ln_sigma() - lamp_sigma() * ahead - Spectrum(path.shift));
}

/// Sum of the densities of the bridges that could have been made from earlier vertices of the walk.
fn techniques_before(total_order: u32, lamp: vec3f) -> f32 {
    let first = select(1u, 0u, subpath.rooted);
    var density = 0.0;
    if subpath.count < 2u {
        return density;
    }
    var i = 0u;
    loop {
        let order = total_order - (i + first);
        let extra = scratch[turn_row(i)];
        if order <= most_from(i) && extra.w > 0.0 {
            let vertex = scratch[vertex_row(i)];
            let start = bridge_start(vertex.xyz, vertex.w, drawn_up_to(i, vertex.w), lamp, i + 1u, 0u);
            density += extra.w * technique_density(start, order, subpath.rooted && i == 0u, extra.z);
        }
        i += 1u;
        if i == FREE_VERTICES {
            // No bridge from a vertex in between has so low an order.
            i = max(i, total_order - min(total_order, first + late_order()));
        }
        if i + 1u >= subpath.count {
            break;
        }
    }
    return density;
}

/// Sum of the densities of the walk's making some of the bridge's vertices, or all of them and meeting the lamp.
fn techniques_after(connection: Connection) -> f32 {
    var length = path.last_length;
    var drawn = path.last_drawn;
    var reflected = 1.0;
    var density = 0.0;
    if bridge.order == 0u {
        return hit_density(drawn, connection.facing);
    }
    var i = 0u;
    loop {
        if !is_joined(subpath.count + i + 1u) {
            return density;
        }
        let vertex = bridge_vertex(i);
        let extra = scratch[extra_row(i)];
        length += vertex.w;
        drawn += drawn_segment(i, vertex.w);
        reflected *= extra.y;
        let order = bridge.order - 1u - i;
        if order <= most_from(subpath.count + i) {
            let start = bridge_start(vertex.xyz, length, drawn, connection.lamp, subpath.count, i + 1u);
            density += reflected * technique_density(start, order, false, phase_value(extra.x));
        }
        i += 1u;
        if i >= bridge.order {
            break;
        }
    }
    return density + reflected * hit_density(drawn, connection.facing);
}

/// ln of the density of a bridge over that of its angles, without 1/D².
fn ln_bridge(way: Stretch) -> Spectrum {
    let distance = sqrt(way.distance2);
    let length = max(way.length, distance);
    let ln_ratio = ln_1p((distance - length) / length);
    let order = f32(way.order);
    let poisson = Spectrum(LN_POISSON_SHARE + (order + 1.0) * ln_ratio) - lamp_sigma() * distance + ln_power(way.order, lamp_ln_sigma());
    let tail = Spectrum(order_ln_tail(way.order) + ln_ratio - order * log(length));
    let most = max(poisson, tail);
    return most + log(exp(max(poisson - most, Spectrum(-80.0))) + exp(max(tail - most, Spectrum(-80.0))));
}

/// ln of a power, of 0 too.
fn ln_power(exponent: u32, ln: Spectrum) -> Spectrum {
    return select(f32(exponent) * ln, Spectrum(0.0), exponent == 0u);
}

/// Which of the path's vertices after the subpath's first is the first in the beam; NONE: none of them, or more than led ways have.
fn first_in_beam(beam: Beam) -> u32 {
    let walked = subpath.count - 1u;
    if walked + bridge.order > largest_order() {
        return NONE;
    }
    var i = 0u;
    loop {
        if i >= walked + bridge.order {
            break;
        }
        var position: vec3f;
        if i < walked {
            position = scratch[vertex_row(i + 1u)].xyz;
        } else {
            position = bridge_vertex(i - walked).xyz;
        }
        if is_in_beam(beam, position) {
            return i;
        }
        i += 1u;
    }
    return NONE;
}

/// Density of leading bridges from the subpath's first vertex by way of the path's vertex `middle` after that, which lies in the beam.
fn density_through_beam(connection: Connection, middle: u32, last_reflected: f32) -> f32 {
    let walked = subpath.count - 1u;
    let order = walked + bridge.order;
    if middle == NONE {
        return 0.0;
    }
    let first = scratch[vertex_row(0u)];
    let extra = scratch[turn_row(0u)];
    let total = path.last_length + bridge.length - first.w;
    var position: vec3f;
    var length_to = path.last_length - first.w;
    var onwards = connection.scattering_pdf;
    if middle < walked {
        let vertex = scratch[vertex_row(middle + 1u)];
        position = vertex.xyz;
        length_to = vertex.w - first.w;
        if middle + 1u < walked {
            onwards = scratch[turn_row(middle + 1u)].z;
        }
    } else {
        var i = 0u;
        loop {
            let vertex = bridge_vertex(i);
            length_to += vertex.w;
            position = vertex.xyz;
            if i >= middle - walked {
                break;
            }
            i += 1u;
        }
        onwards = phase_value(scratch[extra_row(middle - walked)].x);
    }
    let from_lamp = position - connection.lamp;
    let from_first = position - first.xyz;
    let to_lamp2 = dot(from_lamp, from_lamp);
    if to_lamp2 == 0.0 {
        return 0.0;
    }
    let to_lamp = sqrt(to_lamp2);
    let pdf = beam_pdf(connection.beam, from_lamp / to_lamp, to_lamp);
    let distance2 = dot(from_first, from_first);
    let both = ln_bridge(Stretch(middle, length_to, distance2)) + ln_bridge(Stretch(order - 1u - middle, total - length_to, to_lamp2));
    let ln_first = path.ln_walk_density - lamp_sigma() * (first.w - path.last_drawn) - ln_power(walked, lamp_ln_sigma());
    let leaving = select(extra.z, connection.scattering_pdf, walked == 0u);
    let density = sum_exp(ln_first + both - Spectrum(path.shift)) * distance2 / max(leaving, 1e-35);
    return min(density * pdf / max(onwards, 1e-35) * extra.w / last_reflected, 1e36);
}

/// Radiance per channel, for unit intensity, of the way that two bridges make by a point of a spot: from the walk's last vertex, where the
/// first starts with density `scattering_pdf`, and from the spot to the lamp. The first scatters surely `from_surface`.
fn contribution_by_spot(channels: ChannelSampling, scattering_pdf: f32, from_surface: bool, to_spot: Stretch, to_lamp: Stretch) -> Spectrum {
    var ln = max(channels.ln_density, Spectrum(LN_ZERO)) + ln_bridge(to_spot) + ln_bridge(to_lamp);
    if from_surface {
        ln -= ln_scattered(sqrt(to_spot.distance2));
    }
    let shift = largest(used(ln, max(lamp_strategies(), 1u)));
    let density = sum_exp(ln - Spectrum(shift)) * to_spot.distance2 / max(scattering_pdf, 1e-35) * to_lamp.distance2;
    let ln_scale = log(bridge.crossing * f32(channels.count)) - log(density) - shift;
    let ln_light = ln_power(to_spot.order + to_lamp.order, water_ln_b()) - water_c() * (to_spot.length + to_lamp.length) + Spectrum(ln_scale);
    return channels.value * exp(clamp(ln_light, Spectrum(-200.0), Spectrum(85.0)));
}

/// Drawn length of segment `i` of the bridge, which is `length` long.
fn drawn_segment(i: u32, length: f32) -> f32 {
    if HAS_LAYERS {
        return scratch[drawn_row(i)].y;
    }
    return length;
}

/// Density of the walk over the probability of the bridges that are made from the subpath's first vertex.
fn root_density(ln_walk_density: Spectrum, lamp: vec3f) -> Spectrum {
    if !subpath.scattered {
        return ln_walk_density;
    }
    return ln_walk_density - ln_scattered(drawn_between(scratch[vertex_row(0u)].xyz, lamp, BY_SCATTERING));
}

/// ln of the probability that a bridge of a drawn length scatters.
fn ln_scattered(drawn: f32) -> Spectrum {
    let depth = lamp_sigma() * drawn;
    return log(Spectrum(scattered_share(depth.x), scattered_share(depth.y), scattered_share(depth.z)));
}

/// Share of the walk in making a way to a surface that a beam lights; the rest are bridges to the spot. A function of the way alone,
/// however the walk came to where it starts.
fn share_of_walk(way: WayToSpot) -> f32 {
    let walked = ln_power(way.stretch.order, lamp_ln_sigma()) - lamp_sigma() * way.stretch.length;
    var bridged = ln_bridge(way.stretch);
    if way.from_surface {
        bridged -= ln_scattered(sqrt(way.stretch.distance2));
    }
    let shift = Spectrum(largest(used(bridged, max(lamp_strategies(), 1u))));
    let by_walk = min(sum_exp(walked - shift) * way.reflected * way.facing, 1e36);
    let by_bridge = min(sum_exp(bridged - shift) * way.stretch.distance2 / max(way.scattering_pdf, 1e-35), 1e36);
    return by_walk / max(by_walk + by_bridge, 1e-35);
}

/// Radiance per channel, for unit intensity, of the path made by the walk and by the bridge.
fn mis_contribution(channels: ChannelSampling, connection: Connection) -> Spectrum {
    if HAS_SCATTERING {
        return mis_of_scattered(channels, connection);
    }
    let reflected = bridge.crossing;
    let density = bridge.distance * bridge.distance / connection.scattering_pdf + reflected * connection.facing;
    return channels_weight(channels) * transmittance_of_bridge() * (reflected / density);
}

fn transmittance_of_bridge() -> Spectrum {
    if HAS_LAYERS {
        return exp(-min(bridge.depth, Spectrum(200.0)));
    }
    return transmittance(bridge.distance);
}

fn mis_of_scattered(channels: ChannelSampling, connection: Connection) -> Spectrum {
    if subpath.count == 0u {
        return Spectrum(0.0);
    }
    let last = subpath.count - 1u;
    let vertex = scratch[vertex_row(last)];
    let last_length = vertex.w;
    let last_drawn = drawn_up_to(last, last_length);
    let last_reflected = scratch[turn_row(last)].w;
    let order = bridge.order;
    let ln_walk = max(channels.ln_density, Spectrum(LN_ZERO));
    path = PathToLamp(f32(order), last_length, last_drawn, bridge.length, ln_walk, root_density(ln_walk, connection.lamp), 0.0);
    var start = BridgeStart(last_length, last_drawn, bridge.distance * bridge.distance, bridge.drawn, 0.0);
    if HAS_LAYERS {
        start = bridge_start(vertex.xyz, last_length, last_drawn, connection.lamp, subpath.count, 0u);
    }
    let root = subpath.rooted && last == 0u;
    // Relative to the technique that made the path: single densities may be out of the range of a float.
    let own = ln_densities(start, order, root);
    path.shift = largest(used(max(own.poisson, own.tail), max(lamp_strategies(), 1u)));
    var density = technique_density(start, order, root, connection.scattering_pdf);
    if HAS_BEAMS && connection.beam.is_led {
        let middle = first_in_beam(connection.beam);
        if connection.middle != NONE && connection.middle != middle {
            return Spectrum(0.0);
        }
        density += density_through_beam(connection, middle, last_reflected);
    }
    if subpath.companions {
        let scatterings = subpath.count - select(0u, 1u, subpath.rooted);
        density += techniques_before(scatterings + order, connection.lamp) / last_reflected + techniques_after(connection);
    } else if order == 0u {
        density += bridge.crossing * hit_density(last_drawn, connection.facing);
    }
    let ln_scale = log(bridge.crossing * f32(channels.count)) - log(density) - path.shift;
    var ln_b = select(f32(order) * water_ln_b(), Spectrum(0.0), order == 0u);
    var depth = water_c() * bridge.length;
    if HAS_LAYERS {
        ln_b = bridge.ln_b;
        depth = bridge.depth;
    }
    let ln_light = ln_b - depth + Spectrum(ln_scale);
    return channels.value * exp(clamp(ln_light, Spectrum(-200.0), Spectrum(85.0)));
}
