// Free flights of walks that look for daylight, and scatterings.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::air_lamps::{around_air_lamp, density_around_air_lamps, draw_lamp_point};
import package::common::ambient_walk::{AmbientWalk, DirectionNumbers, LEADING, SCATTERED_BEFORE, along, direction_numbers, push_walk, sin2_half_to_sun, turned_walk};
import package::common::camera::{BOUNDARY, End, SCATTER, SURFACE};
import package::common::daylight::field_sun_share;
import package::common::interface::{depth_of, internal_reflectance};
import package::common::layer_distance::distance_of;
import package::common::layer_tables::BY_ATTENUATION;
import package::common::layers::{water_at, way_along};
import package::common::layout::{HAS_AIR_LAMPS, HAS_DAYLIGHT_FIELD, HAS_GEOMETRY_IN_AIR, HAS_SCATTERING, HAS_SKY, HAS_SUN, HAS_SURFACE, INFINITE, NONE, Spectrum, scene};
import package::common::math::{circle, ln_1p, minus_ln, sin2_half};
import package::common::medium::{ChannelSampling, channels_pass, channels_scatter, transmittance_along, used, one_minus_exp};
import package::common::phase::{phase_sample_x, phase_value};
import package::common::rng::{uniform_number, unit};

/// Shares of directions drawn around the sun where no field tells it, in the cone through which the sky is seen, and around lamps in the
/// air over the number of events.
const SUN_SHARE: f32 = 0.15;
const SKY_SHARE: f32 = 0.1;
const LAMP_SHARE: f32 = 0.4;
/// Scatterings that may be drawn towards the sky.
const SKY_EVENTS: u32 = 4u;
/// Kinds of directions at a scattering.
const AROUND_SUN: u32 = 0u;
const TOWARDS_SKY: u32 = 1u;
const AROUND_LAMP: u32 = 2u;
const AROUND_OLD: u32 = 3u;
const TAU: f32 = 6.2831853;

/// 1 − e^(−σ length) per strategy, not below what a logarithm can take.
fn chance_within(sigma: Spectrum, length: f32) -> Spectrum {
    let depth = sigma * length;
    return max(one_minus_exp(depth), Spectrum(1e-30));
}

fn add_ambient_ln(s: ChannelSampling, ln: Spectrum) -> ChannelSampling {
    var next = s;
    next.ln_density = used(s.ln_density + ln, s.count);
    return next;
}

/// What happens next on a segment: SCATTER, BOUNDARY or NOTHING, after `t`.
struct Flight {
    kind: u32,
    t: f32,
    channels: ChannelSampling,
}

/// Before a surface a scattering for certain. Below the water's surface a scattering or a meeting with it: where everything
/// that leaves has been scored, the walk stays in the water. Elsewhere a flight in water that goes on for ever.
fn draw_flight(w: AmbientWalk, end: End, sigma: Spectrum, u: f32) -> Flight {
    var flight = Flight(end.kind, end.t, w.channels);
    let below_surface = HAS_SURFACE && end.kind == BOUNDARY;
    var reflectance = 1.0;
    var leaving = 0.0;
    if below_surface {
        reflectance = internal_reflectance(w.direction.z);
        leaving = select(1.0 - reflectance, 0.0, HAS_GEOMETRY_IN_AIR);
    }
    if !HAS_SCATTERING {
        flight.channels.value *= transmittance_along(w.origin, w.direction, end.t) * (1.0 - leaving);
        return flight;
    }
    let chosen = w.channels.chosen;
    let full = way_along(w.origin, w.direction, end.t, BY_ATTENUATION);
    let within = chance_within(sigma, full.drawn);
    var staying = Spectrum(1.0);
    var v = u;
    if end.kind == SURFACE {
        staying = within;
    } else if below_surface {
        let through = exp(-min(sigma * full.drawn, Spectrum(87.0)));
        staying = max(select(Spectrum(1.0) - leaving * through, within, vec3<bool>(leaving == 1.0)), Spectrum(1e-30));
        let reached = (1.0 - leaving) * through[chosen] / staying[chosen];
        if u < reached {
            flight.channels = channels_pass(w.channels, sigma, full.drawn, full.depth);
            var ln = -log(staying);
            if !HAS_GEOMETRY_IN_AIR {
                flight.channels.value *= reflectance;
                ln += Spectrum(log(max(reflectance, 1e-30)));
            }
            flight.channels = add_ambient_ln(flight.channels, ln);
            return flight;
        }
        v = (u - reached) / (1.0 - reached);
    }
    flight.kind = SCATTER;
    if end.kind == SURFACE || below_surface {
        flight.t = distance_of(w.origin, w.direction, end.t, -ln_1p(-v * within[chosen]) / sigma[chosen], BY_ATTENUATION);
    } else {
        flight.t = distance_of(w.origin, w.direction, INFINITE, minus_ln(v) / sigma[chosen], BY_ATTENUATION);
    }
    // The density of the flight given that it stays.
    let ln_sigma = log(max(sigma, Spectrum(1e-30)) / staying);
    let way = way_along(w.origin, w.direction, flight.t, BY_ATTENUATION);
    let here = water_at(w.origin + flight.t * w.direction, BY_ATTENUATION);
    flight.channels = channels_scatter(w.channels, sigma, ln_sigma, way.drawn, way.depth, here.ln_b);
    return flight;
}

/// Expected numbers of directions drawn at a scattering: around the old one and around the sun, per strategy; in the cone
/// through which the sky is seen; around lamps in the air.
struct Counts {
    own: Spectrum,
    sun: Spectrum,
    sky: f32,
    lamp: f32,
}

fn counts_of(w: AmbientWalk) -> Counts {
    let sees_sky = HAS_SURFACE && HAS_SKY;
    if w.events == 1u {
        return Counts(Spectrum(1.0), Spectrum(select(0.0, 1.0, HAS_SUN)), select(0.0, 1.0, sees_sky), select(0.0, 1.0, HAS_AIR_LAMPS));
    }
    var sun = Spectrum(0.0);
    if HAS_SUN {
        sun = Spectrum(SUN_SHARE);
        if HAS_DAYLIGHT_FIELD {
            sun = field_sun_share(depth_of(w.origin), w.direction);
        }
    }
    let sky = select(0.0, SKY_SHARE, sees_sky && w.events <= SKY_EVENTS);
    let counts = Counts(Spectrum(1.0 - sky) - sun, sun, sky, 0.0);
    if !HAS_AIR_LAMPS {
        return counts;
    }
    // Each event less: what they all take from the old direction stays bounded.
    let lamp = LAMP_SHARE / f32(w.events);
    let rest = 1.0 - lamp;
    return Counts(rest * counts.own, rest * sun, rest * sky, lamp);
}

/// Cosine of the edge of the cone through which the sky is seen from below.
fn lowest_sky() -> f32 {
    let index = scene.refractive_index;
    return sqrt(max(1.0 - 1.0 / (index * index), 0.0));
}

/// A scattering after `t`: new directions around the old one, around the sun, towards the sky or around a lamp in the air. The first scattering makes
/// one of each, later ones one of them.
fn scatter_ambient(walk: AmbientWalk, t: f32) {
    var w = walk;
    w.origin += t * w.direction;
    if HAS_SURFACE {
        w.origin.z = min(w.origin.z, scene.surface_height_m);
    }
    w.start_primitive = NONE;
    w.flags |= SCATTERED_BEFORE;
    w.events += 1u;
    let numbers = direction_numbers(w);
    w.flags &= ~LEADING;
    let counts = counts_of(w);
    let first = w.events == 1u;
    var choice = 1.0;
    if HAS_AIR_LAMPS {
        w.lamp_point = draw_lamp_point();
    }
    if !first && (HAS_SUN || HAS_AIR_LAMPS || counts.sky > 0.0) {
        choice = uniform_number();
    }
    let sun = counts.sun[w.channels.chosen];
    var kind = AROUND_OLD;
    if first {
        kind = next_kind(0u, counts);
    } else if choice < sun {
        kind = AROUND_SUN;
    } else if choice < sun + counts.sky {
        kind = TOWARDS_SKY;
    } else if choice < sun + counts.sky + counts.lamp {
        kind = AROUND_LAMP;
    }
    // One after the other through the same code, because compilers copy what is called from several places.
    loop {
        go_along(w, kind, numbers, counts);
        kind = next_kind(kind + 1u, counts);
        if !first || kind > AROUND_OLD {
            break;
        }
    }
}

/// The first possible kind from `kind` on.
fn next_kind(kind: u32, counts: Counts) -> u32 {
    var next = kind;
    if next == AROUND_SUN && !HAS_SUN {
        next = TOWARDS_SKY;
    }
    if next == TOWARDS_SKY && counts.sky == 0.0 {
        next = AROUND_LAMP;
    }
    if next == AROUND_LAMP && !HAS_AIR_LAMPS {
        next = AROUND_OLD;
    }
    return next;
}

/// Sends a copy of `w` on along a direction of one kind, weighted by all ways of drawing it.
fn go_along(w: AmbientWalk, kind: u32, numbers: DirectionNumbers, counts: Counts) {
    let lowest = lowest_sky();
    var copy: AmbientWalk;
    // sin²(θ/2) from the axis that the direction was drawn around is known without cancellation.
    var x = 0.0;
    if kind == TOWARDS_SKY {
        let up = lowest + (1.0 - lowest) * unit(numbers.bits);
        copy = along(w, vec3f(sqrt(max(1.0 - up * up, 0.0)) * circle(numbers.v), up));
    } else {
        x = phase_sample_x(numbers.bits);
        if HAS_AIR_LAMPS && kind == AROUND_LAMP {
            copy = along(w, around_air_lamp(w, x, numbers.v));
        } else {
            copy = turned_walk(w, kind == AROUND_SUN, x, numbers.v);
        }
    }
    let phase = phase_value(select(sin2_half(w.from_sun, copy.from_sun), x, kind == AROUND_OLD));
    if !(phase > 0.0) {
        return;
    }
    var density = counts.own;
    if HAS_SUN {
        density += counts.sun * (phase_value(select(sin2_half_to_sun(copy), x, kind == AROUND_SUN)) / phase);
    }
    if counts.sky > 0.0 && copy.direction.z >= lowest {
        density += Spectrum(counts.sky / (TAU * (1.0 - lowest)) / phase);
    }
    if HAS_AIR_LAMPS {
        density += Spectrum(counts.lamp * density_around_air_lamps(w, copy.direction) / phase);
    }
    copy.channels = add_ambient_ln(copy.channels, log(max(density, Spectrum(1e-30))));
    push_walk(copy);
}
