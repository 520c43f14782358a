// Free flights of walks that look for daylight, and scatterings.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::air_lamps::{around_air_lamp, density_around_air_lamps, draw_lamp_point};
import package::common::ambient_walk::{AmbientWalk, DirectionNumbers, Heading, LEADING, SCATTERED_BEFORE, direction_numbers, headed, heading_along, push_walk, sin2_half_to_sun, turned_heading};
import package::common::camera::{BOUNDARY, End, SCATTER, SURFACE};
import package::common::daylight::{worth_along, worths_at};
import package::common::interface::{depth_of, internal_reflectance};
import package::common::layer_distance::distance_of;
import package::common::layer_tables::BY_ATTENUATION;
import package::common::layers::{water_at, way_along};
import package::common::layout::{HAS_AIR_LAMPS, HAS_DAYLIGHT_FIELD, HAS_GEOMETRY_IN_AIR, HAS_SCATTERING, HAS_SKY, HAS_SUN, HAS_SURFACE, INFINITE, NONE, Spectrum, scene};
import package::common::math::{circle, ln_1p, minus_ln, sin2_half};
import package::common::medium::{ChannelSampling, channels_pass, channels_scatter, transmittance_along, used, one_minus_exp};
import package::common::phase::{phase_sample_x, phase_value, sun_phase_peak};
import package::common::rng::{uniform_number, unit};

/// Shares of directions drawn around the sun where no field tells it, in the cone through which the sky is seen, and around lamps in the
/// air over the number of events.
const SUN_SHARE: f32 = 0.15;
const SKY_SHARE: f32 = 0.1;
const LAMP_SHARE: f32 = 0.4;
/// Candidates for the direction of a scattering after the first, where the field of daylight tells what each is worth, and what takes the
/// numbers of one to those of the next: powers of the root of x⁴ = x + 1 (Roberts 2018).
const CANDIDATES: u32 = 3u;
const CHOICE_STEP: f32 = 0.8191725;
const BITS_STEP: u32 = 2882110345u;
const TURN_STEP: f32 = 0.5497005;
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

/// Expected numbers of directions drawn at a scattering, or shares of each candidate: around the old one, around the sun, in the cone
/// through which the sky is seen, around lamps in the air.
struct Counts {
    own: f32,
    sun: f32,
    sky: f32,
    lamp: f32,
}

/// Of a walk at the place where it scatters; `worths` as `worths_at` gives it.
fn counts_of(w: AmbientWalk, worths: u32) -> Counts {
    let sees_sky = HAS_SURFACE && HAS_SKY;
    if w.events == 1u {
        return Counts(1.0, select(0.0, 1.0, HAS_SUN), select(0.0, 1.0, sees_sky), select(0.0, 1.0, HAS_AIR_LAMPS));
    }
    var sun = 0.0;
    if HAS_SUN {
        sun = SUN_SHARE;
        if HAS_DAYLIGHT_FIELD {
            sun = worth_along(worths, w.direction).sun_share;
        }
    }
    let sky = select(0.0, SKY_SHARE, sees_sky && w.events <= SKY_EVENTS);
    let counts = Counts(1.0 - sky - sun, sun, sky, 0.0);
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

/// A scattering after `t`: new directions around the old one, around the sun, towards the sky or around a lamp in the air. The first
/// scattering makes one of each. Later ones draw candidates, of which one goes on, by the light that is expected from there (resampled
/// importance sampling, Talbot et al. 2005): mean of what all are worth over their density, over what that one is.
fn scatter_ambient(walk: AmbientWalk, t: f32) {
    var w = walk;
    w.origin += t * w.direction;
    if HAS_SURFACE {
        w.origin.z = min(w.origin.z, scene.surface_height_m);
    }
    w.start_primitive = NONE;
    w.flags |= SCATTERED_BEFORE;
    w.events += 1u;
    var numbers = direction_numbers(w);
    w.flags &= ~LEADING;
    if HAS_AIR_LAMPS {
        w.lamp_point = draw_lamp_point();
    }
    var worths = 0u;
    if HAS_DAYLIGHT_FIELD {
        worths = worths_at(depth_of(w.origin));
    }
    let counts = counts_of(w, worths);
    let first = w.events == 1u;
    var candidates = 1u;
    var choice = 1.0;
    if HAS_DAYLIGHT_FIELD && !HAS_AIR_LAMPS {
        candidates = CANDIDATES;
    }
    if !first && (HAS_SUN || HAS_AIR_LAMPS || counts.sky > 0.0) {
        choice = uniform_number();
    }
    var sum = 0.0;
    var heading: Heading;
    var worth = 0.0;
    var i = 0u;
    var kind = select(kind_of(choice, counts), next_kind(0u, counts), first);
    // One after the other through the same code, because compilers copy what is called from several places.
    loop {
        let one = candidate(w, kind, numbers, counts, worths);
        if first {
            if one.density > 0.0 {
                go_along(w, one.heading, 1.0 / one.density);
            }
            kind = next_kind(kind + 1u, counts);
            if kind > AROUND_OLD {
                break;
            }
        } else {
            if one.density > 0.0 {
                sum += one.worth / one.density;
                if uniform_number() * sum < one.worth / one.density {
                    heading = one.heading;
                    worth = one.worth;
                }
            }
            i += 1u;
            if i >= candidates {
                break;
            }
            // Candidates need not be independent, and those of a rank-1 lattice lie apart.
            numbers.bits += BITS_STEP;
            numbers.v = fract(numbers.v + TURN_STEP);
            choice = fract(choice + CHOICE_STEP);
            kind = kind_of(choice, counts);
        }
    }
    if sum > 0.0 {
        go_along(w, heading, sum / (f32(candidates) * worth));
    }
}

/// The kind that a number in (0, 1) stands for.
fn kind_of(choice: f32, counts: Counts) -> u32 {
    if choice < counts.sun {
        return AROUND_SUN;
    }
    if choice < counts.sun + counts.sky {
        return TOWARDS_SKY;
    }
    return select(AROUND_OLD, AROUND_LAMP, choice < counts.sun + counts.sky + counts.lamp);
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

fn go_along(walk: AmbientWalk, heading: Heading, weight: f32) {
    var w = headed(walk, heading);
    w.channels.value *= weight;
    push_walk(w);
}

/// A direction that was drawn.
struct Candidate {
    heading: Heading,
    /// Of all ways of drawing it, over the phase function's; 0 where nothing scatters there.
    density: f32,
    /// The light that is expected from there.
    worth: f32,
}

/// A direction of one kind for a walk.
fn candidate(w: AmbientWalk, kind: u32, numbers: DirectionNumbers, counts: Counts, worths: u32) -> Candidate {
    let lowest = lowest_sky();
    var one: Candidate;
    one.worth = 1.0;
    // sin²(θ/2) from the axis that the direction was drawn around is known without cancellation.
    var x = 0.0;
    if kind == TOWARDS_SKY {
        let up = lowest + (1.0 - lowest) * unit(numbers.bits);
        one.heading = heading_along(vec3f(sqrt(max(1.0 - up * up, 0.0)) * circle(numbers.v), up));
    } else {
        x = phase_sample_x(numbers.bits);
        if HAS_AIR_LAMPS && kind == AROUND_LAMP {
            one.heading = heading_along(around_air_lamp(w, x, numbers.v));
        } else {
            one.heading = turned_heading(w, kind == AROUND_SUN, x, numbers.v);
        }
    }
    let phase = phase_value(select(sin2_half(w.from_sun, one.heading.from_sun), x, kind == AROUND_OLD));
    if !(phase > 0.0) {
        return one;
    }
    var to_sun = 0.0;
    one.density = counts.own;
    if HAS_SUN {
        to_sun = phase_value(select(sin2_half_to_sun(one.heading.from_sun), x, kind == AROUND_SUN));
        one.density += counts.sun * (to_sun / phase);
    }
    if counts.sky > 0.0 && one.heading.direction.z >= lowest {
        one.density += counts.sky / (TAU * (1.0 - lowest)) / phase;
    }
    if HAS_AIR_LAMPS {
        one.density += counts.lamp * density_around_air_lamps(w, one.heading.direction) / phase;
    } else if HAS_DAYLIGHT_FIELD {
        let worth = worth_along(worths, one.heading.direction);
        one.worth = worth.light;
        if HAS_SUN {
            one.worth += worth.sunlight * min(to_sun, sun_phase_peak());
        }
    }
    return one;
}
