// Attenuation in the water and the weight of a path in three channels.
// The densities of the strategies are carried as logarithms, relative to the largest.
// Host: crates/render/src/prepare/medium.rs. Checked by: tests/system/ (closed_form, validator, furnace,
// radiative_transfer; gpu: both precisions).
import package::common::math::expm1;
import package::common::layer_tables::BY_ATTENUATION;
import package::common::layers::way_along;
import package::common::layout::{HAS_MEDIUM, Spectrum};
import package::common::spectrum::{lamp_ln_sigma, lamp_sigma, water_c};

/// The logarithm of zero.
const LN_ZERO: f32 = -1e30;

struct ChannelSampling {
    value: Spectrum,
    ln_density: Spectrum,
    count: u32,
    chosen: u32,
}

fn transmittance(range_m: f32) -> Spectrum {
    if !HAS_MEDIUM {
        return Spectrum(1.0);
    }
    return exp(-min(water_c() * range_m, Spectrum(200.0)));
}

/// Transmittance of the way from a point in the water, of `length` m.
fn transmittance_along(origin: vec3f, direction: vec3f, length: f32) -> Spectrum {
    if !HAS_MEDIUM {
        return Spectrum(1.0);
    }
    return exp(-min(way_along(origin, direction, length, BY_ATTENUATION).depth, Spectrum(200.0)));
}

/// 1 − e^(−depth) without cancellation.
fn one_minus_exp(depth: Spectrum) -> Spectrum {
    return -Spectrum(expm1(-depth.x), expm1(-depth.y), expm1(-depth.z));
}

/// A path before its first event; `u` in (0, 1) chooses among `strategies`.
fn channels_start(strategies: u32, u: f32) -> ChannelSampling {
    let count = max(strategies, 1u);
    let chosen = min(u32(u * f32(count)), count - 1u);
    return ChannelSampling(Spectrum(1.0), used(Spectrum(0.0), count), count, chosen);
}

/// What is left of the number that `channels_start` chose a strategy by: in [0, 1) and as good as new.
fn rest_of_start(s: ChannelSampling, u: f32) -> f32 {
    return fract(u * f32(s.count));
}

/// Logarithms of the strategies in use, that of zero for the others.
fn used(ln: Spectrum, count: u32) -> Spectrum {
    return select(Spectrum(LN_ZERO), ln, vec3u(0u, 1u, 2u) < vec3u(count));
}

fn largest(v: Spectrum) -> f32 {
    return max(v.x, max(v.y, v.z));
}

/// Weight per channel, value over the mean density of the strategies.
fn channels_weight(s: ChannelSampling) -> Spectrum {
    let density = exp(max(s.ln_density, Spectrum(-200.0)));
    let in_use = select(Spectrum(0.0), density, vec3u(0u, 1u, 2u) < vec3u(s.count));
    return s.value * (f32(s.count) / (in_use.x + in_use.y + in_use.z));
}

/// Multiplies densities and integrand by the exponentials of `ln_density` and `ln_value`.
fn channels_step(s: ChannelSampling, ln_density: Spectrum, ln_value: Spectrum) -> ChannelSampling {
    var next = s;
    let ln = used(s.ln_density + ln_density, s.count);
    let shift = largest(ln);
    next.ln_density = max(ln - Spectrum(shift), Spectrum(LN_ZERO));
    next.value = s.value * exp(clamp(ln_value - Spectrum(shift), Spectrum(-200.0), Spectrum(88.0)));
    return next;
}

/// The path scattered after a flight of optical depth `depth`, drawn with density σ e^(−σ drawn) over the drawn length;
/// `ln_b` is the logarithm of the scattering coefficient there, over that of drawn length.
fn channels_scatter(s: ChannelSampling, sigma: Spectrum, ln_sigma: Spectrum, drawn: f32, depth: Spectrum, ln_b: Spectrum) -> ChannelSampling {
    return channels_step(s, ln_sigma - sigma * drawn, ln_b - depth);
}

/// The path went on unscattered, with probability e^(−σ drawn).
fn channels_pass(s: ChannelSampling, sigma: Spectrum, drawn: f32, depth: Spectrum) -> ChannelSampling {
    return channels_step(s, -sigma * drawn, -depth);
}

/// A fresh path after `scatterings`, whose `ln_b` add up to `ln_scattered`, with free flights of drawn length `drawn` and
/// optical depth `depth` in all, the last of them perhaps unfinished.
fn channels_after(s: ChannelSampling, scatterings: u32, drawn: f32, depth: Spectrum, ln_scattered: Spectrum) -> ChannelSampling {
    return channels_step(s, f32(scatterings) * lamp_ln_sigma() - lamp_sigma() * drawn, ln_scattered - depth);
}
