// Multiple importance sampling: the techniques by which one path to a lamp can be made, combined by the balance
// heuristic (Veach and Guibas 1995).
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::bridge::{bridge, bridge_vertex, extra_row, subpath_row};
import package::common::layout::{HAS_SCATTERING, Spectrum, scratch};
import package::common::math::ln_1p;
import package::common::medium::{LN_ZERO, ChannelSampling, channels_weight, largest, transmittance, used};
import package::common::order::{LN_POISSON_SHARE, order_ln_tail, scattered_share};
import package::common::phase::phase_value;
import package::common::settings::{lamp_strategies, largest_order};
import package::common::spectrum::{lamp_ln_sigma, lamp_sigma, water_c, water_ln_b};

/// The vertices of the walk that can be joined to a lamp.
struct CameraSubpath {
    count: u32,
    rooted: bool,
    companions: bool,
    scattered: bool,
}

var<private> subpath: CameraSubpath;

/// How a path goes on from the last vertex of the walk.
struct Connection {
    scattering_pdf: f32,
    lamp: vec3f,
    facing: f32,
}

/// What all techniques of making one path share.
struct PathToLamp {
    more: f32,
    last_length: f32,
    remaining: f32,
    ln_walk_density: Spectrum,
    ln_root_density: Spectrum,
    shift: f32,
}

struct LnDensities {
    poisson: Spectrum,
    tail: Spectrum,
}

var<private> path: PathToLamp;

fn subpath_start() {
    subpath = CameraSubpath(0u, false, true, false);
}

fn subpath_root(position: vec3f, length: f32, reflected: f32, companions: bool, scattered: bool) {
    subpath = CameraSubpath(0u, true, companions, scattered);
    subpath_push(position, length, reflected);
}

/// Adds a vertex; there has to be room.
fn subpath_push(position: vec3f, length: f32, reflected: f32) {
    scratch[subpath_row(subpath.count)] = vec4f(position, length);
    let extra = extra_row(subpath.count);
    scratch[extra].z = 0.0;
    scratch[extra].w = reflected;
    subpath.count += 1u;
}

/// The walk went on from its last vertex with density `scattering_pdf` of its direction.
fn subpath_leave(scattering_pdf: f32) {
    scratch[extra_row(subpath.count - 1u)].z = scattering_pdf;
}

/// The two parts of a technique's density under each strategy, in logarithms, without the factor D²/f.
fn ln_densities(length: f32, distance2: f32, order: u32, root: bool) -> LnDensities {
    let distance = sqrt(distance2);
    let ahead = length - path.last_length;
    // No path is shorter than the straight one; rounding must not say so.
    let to_lamp = max(path.remaining - ahead, distance);
    let steps = f32(order + 1u);
    let ln_ratio = ln_1p((distance - to_lamp) / to_lamp);
    let ln_poisson = LN_POISSON_SHARE + steps * ln_ratio;
    let ln_tail = order_ln_tail(order) + ln_ratio - f32(order) * log(to_lamp);
    let ln_walk = select(path.ln_walk_density, path.ln_root_density, root);
    let sigma = lamp_sigma();
    let common_part = ln_walk - sigma * ahead;
    return LnDensities(
        common_part + Spectrum(ln_poisson) - sigma * distance + path.more * lamp_ln_sigma(),
        common_part + Spectrum(ln_tail) + (path.more - f32(order)) * lamp_ln_sigma(),
    );
}

/// Exponentials of the strategies in use, summed.
fn sum_exp(ln: Spectrum) -> f32 {
    let e = exp(clamp(used(ln, max(lamp_strategies(), 1u)), Spectrum(-200.0), Spectrum(80.0)));
    return e.x + e.y + e.z;
}

/// Sum over the strategies of the density of a technique, relative to e^shift.
fn technique_density(length: f32, distance2: f32, order: u32, root: bool, scattering_pdf: f32) -> f32 {
    let ln = ln_densities(length, distance2, order, root);
    let sum = sum_exp(ln.poisson - Spectrum(path.shift)) + sum_exp(ln.tail - Spectrum(path.shift));
    return min(sum * distance2 / max(scattering_pdf, 1e-35), 1e36);
}

/// Density of a walk that makes all vertices, the last at `length`, and then meets the lamp by chance.
fn hit_density(length: f32, facing: f32) -> f32 {
    if facing == 0.0 {
        return 0.0;
    }
    let ahead = length - path.last_length;
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
        let extra = scratch[extra_row(i)];
        if order <= largest_order() && extra.w > 0.0 {
            let vertex = scratch[subpath_row(i)];
            let offset = vertex.xyz - lamp;
            density += extra.w * technique_density(vertex.w, dot(offset, offset), order, subpath.rooted && i == 0u, extra.z);
        }
        i += 1u;
        if i + 1u >= subpath.count {
            break;
        }
    }
    return density;
}

/// Sum of the densities of the walk's making some of the bridge's vertices, or all of them and meeting the lamp.
fn techniques_after(connection: Connection) -> f32 {
    var length = path.last_length;
    var reflected = 1.0;
    var density = 0.0;
    if bridge.order == 0u {
        return hit_density(length, connection.facing);
    }
    var i = 0u;
    loop {
        let vertex = bridge_vertex(i);
        let extra = scratch[extra_row(i)];
        length += vertex.w;
        reflected *= extra.y;
        let offset = vertex.xyz - connection.lamp;
        density += reflected
            * technique_density(length, dot(offset, offset), bridge.order - 1u - i, false, phase_value(extra.x));
        i += 1u;
        if i >= bridge.order {
            break;
        }
    }
    return density + reflected * hit_density(length, connection.facing);
}

/// Density of the walk over the probability of the bridges that are made from the subpath's first vertex.
fn root_density(ln_walk_density: Spectrum, lamp: vec3f) -> Spectrum {
    if !subpath.scattered {
        return ln_walk_density;
    }
    let distance = length(scratch[subpath_row(0u)].xyz - lamp);
    let depth = lamp_sigma() * distance;
    return ln_walk_density - log(Spectrum(scattered_share(depth.x), scattered_share(depth.y), scattered_share(depth.z)));
}

/// Radiance per channel, for unit intensity, of the path made by the walk and by the bridge.
fn mis_contribution(channels: ChannelSampling, connection: Connection) -> Spectrum {
    if HAS_SCATTERING {
        return mis_of_scattered(channels, connection);
    }
    let reflected = bridge.crossing;
    let density = bridge.distance * bridge.distance / connection.scattering_pdf + reflected * connection.facing;
    return channels_weight(channels) * transmittance(bridge.distance) * (reflected / density);
}

fn mis_of_scattered(channels: ChannelSampling, connection: Connection) -> Spectrum {
    if subpath.count == 0u {
        return Spectrum(0.0);
    }
    let last = subpath.count - 1u;
    let last_length = scratch[subpath_row(last)].w;
    let last_reflected = scratch[extra_row(last)].w;
    let order = bridge.order;
    let ln_walk = max(channels.ln_density, Spectrum(LN_ZERO));
    path = PathToLamp(f32(order), last_length, bridge.length, ln_walk, root_density(ln_walk, connection.lamp), 0.0);
    let distance2 = bridge.distance * bridge.distance;
    let root = subpath.rooted && last == 0u;
    // Relative to the technique that made the path: single densities may be out of the range of a float.
    let own = ln_densities(last_length, distance2, order, root);
    path.shift = largest(used(max(own.poisson, own.tail), max(lamp_strategies(), 1u)));
    var density = technique_density(last_length, distance2, order, root, connection.scattering_pdf);
    if subpath.companions {
        let scatterings = subpath.count - select(0u, 1u, subpath.rooted);
        density += techniques_before(scatterings + order, connection.lamp) / last_reflected + techniques_after(connection);
    } else if order == 0u {
        density += bridge.crossing * hit_density(last_length, connection.facing);
    }
    let ln_scale = log(bridge.crossing * f32(channels.count)) - log(density) - path.shift;
    let ln_b = select(f32(order) * water_ln_b(), Spectrum(0.0), order == 0u);
    let ln_light = ln_b - water_c() * bridge.length + Spectrum(ln_scale);
    return channels.value * exp(clamp(ln_light, Spectrum(-200.0), Spectrum(85.0)));
}
