// The way from a point to a lamp in the air, and what such lamps bring about there, which steers walks.
// Host: crates/render/src/prepare/air_way.rs. Checked by: tests/system/air_lamps.rs, tests/system/validator.rs.
import package::common::interface::{depth_of, external_reflectance};
import package::common::layout::{HAS_REFRACTION, Spectrum, scene};
import package::common::light::{lamp_relative_intensity, lamp_sample_point};
import package::common::math::sin2_half;
import package::common::phase::phase_value;
import package::common::settings::{air_lamp_count, lamp_count};
import package::common::spectrum::{water_b, water_c};
import package::common::tables::{lamp_intensity, lamp_position, lamp_radius};

/// Steps of Newton's method for the way through the surface: at most so many for float precision.
const REFRACTION_STEPS: u32 = 16u;
/// Least sin²(θ/2) between two directions that single precision tells, of an angle of 2e-7 rad.
const LEAST_SIN2_HALF: f32 = 1e-14;
/// What lamps bring outside their beams over what they bring inside, about; and light from everywhere over theirs, 1/sr.
const OUTSIDE_BEAM: f32 = 0.03;
const FROM_EVERYWHERE: f32 = 0.05;

/// The way to a point in the air: unit directions at its beginning and in the air, lengths in water and air, and the irradiance that an
/// intensity of 1 brings along it, across it.
struct AirWay {
    towards: vec3f,
    wet: f32,
    in_air: vec3f,
    dry: f32,
    spread: f32,
}

fn straight_way(point: vec3f, lamp: vec3f) -> AirWay {
    let offset = lamp - point;
    let range = length(offset);
    let towards = offset / range;
    return AirWay(towards, 0.0, towards, range, 1.0 / (range * range));
}

/// The way from a point in the water by Snell's law: the tangent of its angle in the air is found from below, where the
/// horizontal distance, which grows less than it, tells too little.
fn way_through_surface(point: vec3f, lamp: vec3f) -> AirWay {
    let depth = depth_of(point);
    let height = lamp.z - scene.surface_height_m;
    let across = lamp.xy - point.xy;
    let reach = length(across);
    let index = scene.refractive_index;
    let square = index * index;
    let grow = (index - 1.0) * (index + 1.0);
    var tangent = reach / (height + depth / index);
    if HAS_REFRACTION {
        tangent = max(tangent, (reach - depth / sqrt(grow)) / height);
    }
    for (var i = 0u; i < REFRACTION_STEPS; i++) {
        let root = sqrt(square + grow * tangent * tangent);
        let missing = reach - tangent * (height + depth / root);
        tangent += missing / (height + depth * square / (root * root * root));
    }
    let cosine = 1.0 / sqrt(1.0 + tangent * tangent);
    let sine = tangent * cosine;
    let wet_sine = sine / index;
    // The root of 1 less the square of the sine, without cancellation.
    let wet_cosine = sqrt(square + grow * tangent * tangent) * cosine / index;
    let wet = depth / wet_cosine;
    let dry = height / cosine;
    let aside = across / max(reach, 1e-30);
    // A cone of the angles about this one covers a ring of the water; what comes through counts across the way.
    let ring = (dry + wet / index) * (dry / cosine + wet * cosine / (index * wet_cosine * wet_cosine));
    let spread = (1.0 - external_reflectance(cosine)) / (ring * wet_cosine);
    return AirWay(vec3f(aside * wet_sine, wet_cosine), wet, vec3f(aside * sine, cosine), dry, spread);
}

/// The point of lamp `index` that a number tells.
fn told_point(index: u32, number: f32) -> vec3f {
    if lamp_radius(index) == 0.0 {
        return lamp_position(index);
    }
    let bits = u32(number);
    return lamp_sample_point(index, (f32(bits & 0xfffu) + 0.5) / 4096.0, (f32(bits >> 12u) + 0.5) / 4096.0);
}

/// Phase function between two directions that were found apart: nearer to each other than numbers tell they count as that far.
fn phase_towards(direction: vec3f, towards: vec3f) -> f32 {
    return phase_value(max(sin2_half(direction, towards), LEAST_SIN2_HALF));
}

/// Irradiance that a lamp brings to a point, about: nothing casts shadows and what scatters goes on.
fn irradiance_about(index: u32, point: vec3f, way: AirWay) -> Spectrum {
    let relative = OUTSIDE_BEAM + lamp_relative_intensity(index, -way.in_air);
    return relative * way.spread * lamp_intensity(index) * exp(-min((water_c() - water_b()) * way.wet, Spectrum(80.0)));
}

fn way_about(index: u32, point: vec3f, in_air: bool) -> AirWay {
    if in_air {
        return straight_way(point, lamp_position(index));
    }
    return way_through_surface(point, lamp_position(index));
}

/// Irradiance of all of them, about.
fn air_lamps_about(point: vec3f, in_air: bool) -> Spectrum {
    var sum = Spectrum(0.0);
    for (var i = lamp_count(); i < lamp_count() + air_lamp_count(); i++) {
        sum += irradiance_about(i, point, way_about(i, point, in_air));
    }
    return sum;
}

/// Radiance that water scatters of their light against `direction`, about: the nearer to the way to a lamp the more.
fn air_lamps_scattered_about(point: vec3f, direction: vec3f) -> Spectrum {
    var sum = Spectrum(0.0);
    for (var i = lamp_count(); i < lamp_count() + air_lamp_count(); i++) {
        let way = way_through_surface(point, lamp_position(i));
        sum += (FROM_EVERYWHERE + phase_towards(direction, way.towards)) * irradiance_about(i, point, way);
    }
    return sum;
}
