// Lamps in the air: their light on surfaces and scattered once on a segment in the water, by the one way through the water surface, and
// their disks where the camera looks at them.
// Checked by: tests/system/air_lamps.rs, tests/system/validator.rs.
import package::common::air_way::{AirWay, phase_towards, straight_way, told_point, way_through_surface};
import package::common::ambient_walk::{AmbientWalk, IN_AIR, MET_SURFACE, SCATTERED_BEFORE, has};
import package::common::bvh::occluded;
import package::common::daylight::{attenuation_integral, attenuation_sample};
import package::common::film::add_light;
import package::common::gloss::{surface_factor, surface_pdf};
import package::common::layer_distance::distance_of;
import package::common::layer_tables::BY_ATTENUATION;
import package::common::layers::{drawn_along, water_at};
import package::common::layout::{HAS_GEOMETRY_IN_AIR, INFINITE, NONE, Spectrum, scene};
import package::common::light::{lamp_radiance_along, lamp_relative_intensity};
import package::common::math::turn;
import package::common::medium::transmittance_along;
import package::common::rng::{next_bits, uniform_number};
import package::common::settings::{air_lamp_count, lamp_count};
import package::common::spectrum::water_c;
import package::common::surface::SurfacePoint;
import package::common::tables::{lamp_film_layer, lamp_intensity, lamp_level};

/// Least vertical part of the way to a lamp, and least attenuation over the largest, by which points of a segment are drawn.
const LEAST_UP: f32 = 0.2;
const LEAST_ATTENUATION: f32 = 1e-3;
/// Most exponent by which light may grow along a segment that points are drawn on.
const MOST_GROWTH: f32 = 80.0;
/// Farthest point that is drawn by its distance from the lamp, m.
const FARTHEST: f32 = 1e6;

/// Light that arrives from a lamp: irradiance across the direction towards it.
struct AirLight {
    towards: vec3f,
    irradiance: Spectrum,
}

/// A number that tells a point of every disk: 12 bits each of two coordinates.
fn draw_lamp_point() -> f32 {
    return f32(next_bits() >> 8u);
}

/// Direction in the water, at the start of a walk's segment, of the way to the point of lamp `index` that it looks for.
fn towards_lamp(w: AmbientWalk, index: u32) -> vec3f {
    return way_through_surface(w.origin, told_point(index, w.lamp_point)).towards;
}

/// A direction for the walk around that towards one of the lamps, by the angle θ with sin²(θ/2) = `x` that the phase function drew.
/// Where water scatters narrowly, its light comes along such directions alone; as the light that they find is that of the same
/// points, their density takes the peak off it.
fn around_air_lamp(w: AmbientWalk, x: f32, u: f32) -> vec3f {
    let count = air_lamp_count();
    let chosen = min(u32(uniform_number() * f32(count)), count - 1u);
    return turn(towards_lamp(w, lamp_count() + chosen), x, u);
}

/// Density of `direction` among those.
fn density_around_air_lamps(w: AmbientWalk, direction: vec3f) -> f32 {
    var sum = 0.0;
    for (var i = lamp_count(); i < lamp_count() + air_lamp_count(); i++) {
        sum += phase_towards(direction, towards_lamp(w, i));
    }
    return sum / f32(air_lamp_count());
}

/// Light from a point of lamp `index` at a point in the water or in the air, which lies on `start_primitive`.
fn light_from_air(index: u32, source: vec3f, point: vec3f, in_air: bool, start_primitive: u32) -> AirLight {
    var way: AirWay;
    if in_air {
        way = straight_way(point, source);
    } else {
        way = way_through_surface(point, source);
    }
    let relative = lamp_relative_intensity(index, -way.in_air) * way.spread;
    if !(relative > 0.0) || !is_open(way, point, in_air, start_primitive) {
        return AirLight(way.towards, Spectrum(0.0));
    }
    var light = relative * lamp_intensity(index);
    if !in_air {
        light *= transmittance_along(point, way.towards, way.wet);
    }
    return AirLight(way.towards, light);
}

/// Whether nothing stands on the way.
fn is_open(way: AirWay, point: vec3f, in_air: bool, start_primitive: u32) -> bool {
    if in_air {
        return !occluded(point, way.in_air, way.dry, start_primitive);
    }
    if occluded(point, way.towards, way.wet, start_primitive) {
        return false;
    }
    if !HAS_GEOMETRY_IN_AIR {
        return true;
    }
    let exit = vec3f((point + way.wet * way.towards).xy, scene.surface_height_m);
    return !occluded(exit, way.in_air, way.dry, NONE);
}

/// Counts light of a lamp for the walk.
fn count_light(index: u32, w: AmbientWalk, scattered: bool, light: Spectrum) {
    add_light(lamp_film_layer(index), lamp_level(index), has(w, MET_SURFACE), scattered, light);
}

/// Scores the light that a surface with albedo 1, where the walk stands, sends on from the lamps in the air.
fn score_air_lamps_on(w: AmbientWalk, weight: Spectrum, point: SurfacePoint) {
    let number = draw_lamp_point();
    for (var i = lamp_count(); i < lamp_count() + air_lamp_count(); i++) {
        let light = light_from_air(i, told_point(i, number), w.origin, has(w, IN_AIR), w.start_primitive);
        let pdf = surface_pdf(point, light.towards);
        if pdf > 0.0 {
            let reflected = pdf * surface_factor(point, light.towards);
            count_light(i, w, has(w, SCATTERED_BEFORE), weight * light.irradiance * reflected);
        }
    }
}

/// Scores the light that a segment in the water scatters once.
fn score_air_lamps_along(w: AmbientWalk, weight: Spectrum, length: f32) {
    for (var i = lamp_count(); i < lamp_count() + air_lamp_count(); i++) {
        count_light(i, w, true, weight * scattered_from_air(i, told_point(i, w.lamp_point), w, length));
    }
}

/// The sine of the angle at which a distance along a line is seen from a point `aside` from its start.
fn seen_sine(distance: f32, aside: f32) -> f32 {
    return distance / sqrt(distance * distance + aside * aside);
}

/// Mean over the channels of the densities with which `attenuation_sample` draws.
fn mean_density(rate: Spectrum, length: f32, at: f32) -> f32 {
    let even = exp(-clamp(rate * at, Spectrum(-MOST_GROWTH), Spectrum(87.0))) / attenuation_integral(Spectrum(0.0), rate, length);
    return (even.x + even.y + even.z) / 3.0;
}

/// Radiance that light from a point of lamp `index` scattered once on a segment sends back to its start, by one point: near the lamp, or as
/// light is attenuated on the way to the camera, or on both ways. Each is drawn as often and all densities count.
fn scattered_from_air(index: u32, lamp: vec3f, w: AmbientWalk, length: f32) -> Spectrum {
    let origin = w.origin;
    let direction = w.direction;
    let drawn = drawn_along(origin, direction, length, BY_ATTENUATION);
    let nearest = dot(lamp - origin, direction);
    let off_line = lamp - origin - nearest * direction;
    let aside = max(sqrt(dot(off_line, off_line)), lamp.z - scene.surface_height_m);
    let first = seen_sine(-nearest, aside);
    let last = select(seen_sine(length - nearest, aside), 1.0, length >= INFINITE);
    let plain = max(water_c(), Spectrum(LEAST_ATTENUATION * scene.c_max));
    let up = max(way_through_surface(origin, lamp).towards.z, LEAST_UP);
    let both = max(plain * (1.0 - direction.z / up), Spectrum(-MOST_GROWTH / drawn));
    let pick = 3.0 * uniform_number();
    let channel = min(u32(3.0 * uniform_number()), 2u);
    let u = uniform_number();
    var t: f32;
    var at: f32;
    if pick < 1.0 {
        let sine = mix(first, last, u);
        t = clamp(nearest + aside * sine / sqrt(max(1.0 - sine * sine, 1e-12)), 0.0, min(length, FARTHEST));
        at = drawn_along(origin, direction, t, BY_ATTENUATION);
    } else {
        let rate = select(both, plain, pick < 2.0);
        at = attenuation_sample(rate[channel], drawn, u);
        t = distance_of(origin, direction, length, at, BY_ATTENUATION);
    }
    let point = origin + t * direction;
    let here = water_at(point, BY_ATTENUATION);
    let past = t - nearest;
    let range2 = past * past + aside * aside;
    let near = aside * aside / (range2 * sqrt(range2) * max(last - first, 1e-30));
    let density = (near + here.relative * (mean_density(plain, drawn, at) + mean_density(both, drawn, at))) / 3.0;
    let light = light_from_air(index, lamp, point, false, NONE);
    if !(density > 0.0) || all(light.irradiance == Spectrum(0.0)) {
        return Spectrum(0.0);
    }
    let phase = phase_towards(direction, light.towards);
    return here.b * light.irradiance * transmittance_along(origin, direction, t) * (phase / density);
}

/// Scores the disks that the camera looks at, along a way in the air that a walk without an event before has, of this factor.
fn see_air_lamps(w: AmbientWalk, origin: vec3f, direction: vec3f, length: f32, factor: Spectrum) {
    if w.events > 0u {
        return;
    }
    for (var i = lamp_count(); i < lamp_count() + air_lamp_count(); i++) {
        let disk = lamp_radiance_along(i, origin, direction, length);
        if disk.met {
            count_light(i, w, false, factor * disk.radiance);
        }
    }
}
