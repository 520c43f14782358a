// Lamps: points on them, intensity, what is seen of their disks.
// Host: crates/render/src/prepare/lamps.rs. Checked by: tests/system/ (closed_form, validator, furnace,
// radiative_transfer; gpu: both precisions).
import package::common::layout::{NONE, PI, Spectrum};
import package::common::math::circle;
import package::common::tables::{lamp_cos_half_angle, lamp_falloff, lamp_forward, lamp_intensity, lamp_position, lamp_radius, lamp_tangent_u, lamp_tangent_v, table_f32};

const FALLOFF_ENTRIES: u32 = 2048u;

struct Disk {
    met: bool,
    t: f32,
    radiance: Spectrum,
}

/// A point of the lamp, uniform on its disk.
fn lamp_sample_point(index: u32, u: f32, v: f32) -> vec3f {
    let r = lamp_radius(index) * sqrt(u);
    let azimuth = circle(v);
    return lamp_position(index) + r * (azimuth.x * lamp_tangent_u(index) + azimuth.y * lamp_tangent_v(index));
}

/// Intensity in unit direction `emission`, relative to the axis at 100 %.
fn lamp_relative_intensity(index: u32, emission: vec3f) -> f32 {
    let forward = lamp_forward(index);
    let cosine = dot(forward, emission);
    if cosine < lamp_cos_half_angle(index) {
        return 0.0;
    }
    let disk = select(1.0, max(cosine, 0.0), lamp_radius(index) > 0.0);
    let table = lamp_falloff(index);
    if table == NONE {
        return disk;
    }
    let offset = forward - emission;
    let sin_half = clamp(0.5 * length(offset), 0.0, 1.0);
    let position = sin_half * f32(FALLOFF_ENTRIES);
    let i = min(u32(position), FALLOFF_ENTRIES - 1u);
    return disk * mix(table_f32(table + i), table_f32(table + i + 1u), position - f32(i));
}

/// Whether the lamp sends different light in different directions.
fn lamp_is_directed(index: u32) -> bool {
    return lamp_radius(index) > 0.0 || lamp_falloff(index) != NONE || lamp_cos_half_angle(index) > -1.0;
}

/// Area of the disk as it is seen from unit direction `emission`, m².
fn lamp_facing_area(index: u32, emission: vec3f) -> f32 {
    let radius = lamp_radius(index);
    return PI * radius * radius * max(dot(lamp_forward(index), emission), 0.0);
}

/// What a ray sees of the disk's front closer than `t_max`.
fn lamp_radiance_along(index: u32, origin: vec3f, direction: vec3f, t_max: f32) -> Disk {
    let radius = lamp_radius(index);
    let cosine = -dot(lamp_forward(index), direction);
    if radius == 0.0 || cosine <= 0.0 {
        return Disk(false, 0.0, Spectrum(0.0));
    }
    let t = dot(lamp_forward(index), origin - lamp_position(index)) / cosine;
    let offset = origin + t * direction - lamp_position(index);
    if !(t > 0.0 && t < t_max && dot(offset, offset) <= radius * radius) {
        return Disk(false, 0.0, Spectrum(0.0));
    }
    let radiance = lamp_relative_intensity(index, -direction) / (cosine * PI * radius * radius);
    return Disk(true, t, lamp_intensity(index) * radiance);
}
