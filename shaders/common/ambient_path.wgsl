// Daylight and emitting surfaces: a camera walk that scores sun and sky along every segment.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::air_lamps::{around_air_lamp, density_around_air_lamps, draw_lamp_point, score_air_lamps_along, score_air_lamps_on, see_air_lamps};
import package::common::ambient_flight::{draw_flight, scatter_ambient};
import package::common::ambient_queue::numbers;
import package::common::ambient_walk::{AmbientWalk, IN_AIR, LEADING, MET_SURFACE, SCATTERED_BEFORE, along, copies_made, copies_of, diffuse_irradiance, direction_numbers, has, has_reference, has_top, headed, light_ahead, light_on_surface, pending, pop_walk, push_walk, relative_light, score, set_reference, sin2_half_to_sun, survival_of, turned_heading};
import package::common::bvh::{closest, occluded};
import package::common::surface::{SurfacePoint, lit_point};
import package::common::camera::{BOUNDARY, End, NOTHING, SCATTER, SURFACE, end_point, full_segment, no_point};
import package::common::daylight::{scattered_sunlight, sun_reaches};
import package::common::gloss::{surface_albedo, surface_direction, surface_factor, surface_pdf};
import package::common::interface::{depth_of, external_reflectance, flip, internal_reflectance, is_above, refract_into_water};
import package::common::layout::{HAS_AIR, HAS_AIR_LAMPS, HAS_GEOMETRY_IN_AIR, HAS_GLOSS, HAS_MEDIUM, HAS_SCATTERING, HAS_SKY, HAS_SUN, HAS_SURFACE, INFINITE, NONE, PI, Spectrum, counters, dispatch, scene};
import package::common::medium::{channels_start, channels_weight, transmittance_along};
import package::common::phase::{phase_sample_x, phase_value};
import package::common::rng::uniform_number;
import package::common::settings::{ambient_strategies, max_events};
import package::common::spectrum::{sky_radiance, ambient_sigma, sun_irradiance_in_air, sun_irradiance};

/// Shares of directions drawn around the sun and around lamps in the air at a surface.
const SUN_SHARE_SURFACE: f32 = 0.3;
const LAMP_SHARE_SURFACE: f32 = 0.2;

var<private> segments: u32;

/// Starts the walks of a sample that looks from `origin` along `direction`.
fn ambient_start(origin: vec3f, direction: vec3f) {
    pending = 0u;
    has_top = false;
    has_reference = false;
    copies_made = 0u;
    segments = 0u;
    let flags = LEADING | select(0u, IN_AIR, is_above(origin));
    let channels = channels_start(ambient_strategies(), numbers.chooser);
    var lamp_point = 0.0;
    if HAS_AIR_LAMPS {
        lamp_point = draw_lamp_point();
    }
    push_walk(AmbientWalk(origin, direction, direction - scene.sun_towards, NONE, flags, 0u, channels, lamp_point));
}

/// Where a walk is to go on from a surface.
struct AmbientLanding {
    found: bool,
    walk: AmbientWalk,
    point: SurfacePoint,
}

/// One segment of the last of the walks that still have to go on.
fn ambient_step() {
    if segments >= dispatch.most_segments {
        atomicAdd(&counters.cut_paths, pending);
        pending = 0u;
        return;
    }
    let w = pop_walk();
    segments += 1u;
    let is_wet = !HAS_AIR || !has(w, IN_AIR);
    var end = End(NOTHING, INFINITE, NONE, vec2f(0.0));
    var weight = Spectrum(0.0);
    var volume = Spectrum(0.0);
    var landing: AmbientLanding;
    if is_wet {
        end = full_segment(w.origin, w.direction, w.start_primitive);
        var point = no_point();
        if end.kind == SURFACE {
            point = end_point(end, w.direction);
        }
        weight = channels_weight(w.channels);
        let light = water_segment(w, weight, end, point);
        volume = light.volume;
        landing = to_surface(w, weight, end, point, light.surface);
    } else {
        landing = air_segment(w);
    }
    if landing.found {
        meet_surface_ambient(landing.walk, landing.point);
    }
    if is_wet && (may_scatter(w) || end.kind != SURFACE) {
        follow(w, weight, end, volume);
    }
}

fn may_scatter(w: AmbientWalk) -> bool {
    return HAS_SCATTERING && w.events < max_events();
}

/// Light that a segment's walk has still to find: in the water, and from the surface at its end.
struct Ahead {
    volume: Spectrum,
    surface: Spectrum,
}

/// Scores a segment in the water (or in space without water).
fn water_segment(w: AmbientWalk, weight: Spectrum, end: End, point: SurfacePoint) -> Ahead {
    var line = Spectrum(0.0);
    if HAS_MEDIUM && w.events < max_events() {
        line = scattered_sunlight(w.origin, w.direction, end.t, sin2_half_to_sun(w.from_sun));
        score(w, weight, true, line);
    }
    let sky = sky_at_end(w, end);
    score(w, weight, has(w, SCATTERED_BEFORE), sky);
    if HAS_AIR_LAMPS {
        if may_scatter(w) {
            score_air_lamps_along(w, weight, end.t);
        }
        see_through_surface(w, weight, end);
    }
    var ahead = Ahead(Spectrum(0.0), Spectrum(0.0));
    if may_scatter(w) || end.kind != SURFACE {
        ahead.volume = light_ahead(w, end, line);
    }
    if end.kind == SURFACE {
        ahead.surface = light_on_surface(w, end, point);
    }
    set_reference(weight, line + sky + ahead.volume + ahead.surface);
    return ahead;
}

/// Lamps in the air at the end of the segment, where what leaves is not followed.
fn see_through_surface(w: AmbientWalk, weight: Spectrum, end: End) {
    let across = w.direction.xy * scene.refractive_index;
    let vertical2 = 1.0 - dot(across, across);
    if HAS_GEOMETRY_IN_AIR || end.kind != BOUNDARY || vertical2 <= 0.0 {
        return;
    }
    let passed = (1.0 - internal_reflectance(w.direction.z)) * scene.refractive_index * scene.refractive_index;
    let exit = vec3f((w.origin + end.t * w.direction).xy, scene.surface_height_m);
    let factor = weight * transmittance_along(w.origin, w.direction, end.t) * passed;
    see_air_lamps(w, exit, vec3f(across, sqrt(vertical2)), INFINITE, factor);
}

/// The sky at the end of the segment. Where something stands in the air, what leaves is followed instead.
fn sky_at_end(w: AmbientWalk, end: End) -> Spectrum {
    if !HAS_SKY {
        return Spectrum(0.0);
    }
    if HAS_SURFACE && end.kind == BOUNDARY && !HAS_GEOMETRY_IN_AIR {
        let passed = (1.0 - internal_reflectance(w.direction.z)) * scene.refractive_index * scene.refractive_index;
        return sky_radiance() * transmittance_along(w.origin, w.direction, end.t) * passed;
    }
    if !HAS_SURFACE && end.kind == NOTHING {
        return sky_radiance() * transmittance_along(w.origin, w.direction, INFINITE);
    }
    return Spectrum(0.0);
}

/// Unscattered to the surface at the end of the segment, if there is one, by roulette.
fn to_surface(walk: AmbientWalk, weight: Spectrum, end: End, point: SurfacePoint, light: Spectrum) -> AmbientLanding {
    var w = walk;
    if end.kind != SURFACE {
        return AmbientLanding(false, w, point);
    }
    let survival = survival_of(relative_light(weight, light));
    if survival < 1.0 {
        if uniform_number() >= survival {
            return AmbientLanding(false, w, point);
        }
    }
    w.channels.value *= transmittance_along(w.origin, w.direction, end.t) / survival;
    w.origin += end.t * w.direction;
    w.start_primitive = end.primitive;
    return AmbientLanding(true, w, point);
}

/// As many copies of the walk as `light` is worth, each sent on: scattered before a surface, or as the water has it.
fn follow(walk: AmbientWalk, weight: Spectrum, end: End, light: Spectrum) {
    var w = walk;
    let copies = copies_of(w, weight, light);
    w.channels.value *= copies.factor;
    // Flights are stretched towards the light.
    let sigma = ambient_sigma() * max(1.0 - scene.stretch * w.direction.z, Spectrum(0.05));
    if copies.count == 0u {
        return;
    }
    var i = 0u;
    loop {
        var u: f32;
        if has(w, LEADING) {
            u = numbers.flight;
        } else {
            u = uniform_number();
        }
        var copy = w;
        let flight = draw_flight(w, end, sigma, u);
        copy.channels = flight.channels;
        if flight.kind == SCATTER {
            if HAS_SCATTERING && w.events < max_events() {
                scatter_ambient(copy, flight.t);
            }
        } else if flight.kind == BOUNDARY {
            copy.origin += flight.t * w.direction;
            leave_boundary(copy);
        }
        w.flags &= ~LEADING;
        i += 1u;
        if i >= copies.count {
            break;
        }
    }
}

/// At the underside of the water surface: reflected, or into the air where there is something to see.
fn leave_boundary(walk: AmbientWalk) {
    var w = walk;
    let reflectance = internal_reflectance(w.direction.z);
    w.origin.z = scene.surface_height_m;
    w.start_primitive = NONE;
    w.flags &= ~LEADING;
    var reflected = !HAS_GEOMETRY_IN_AIR || reflectance >= 1.0;
    if !reflected {
        reflected = uniform_number() < reflectance;
    }
    if reflected {
        w = along(w, flip(w.direction));
        if reflectance > 0.0 {
            push_walk(w);
        }
        return;
    }
    let across = w.direction.xy * scene.refractive_index;
    let vertical2 = 1.0 - dot(across, across);
    if vertical2 <= 0.0 {
        return;
    }
    w = along(w, vec3f(across, sqrt(vertical2)));
    w.flags |= IN_AIR;
    w.channels.value *= scene.refractive_index * scene.refractive_index;
    push_walk(w);
}

/// One segment in the air above the water.
fn air_segment(walk: AmbientWalk) -> AmbientLanding {
    var w = walk;
    let down = -w.direction.z;
    let to_water = select(INFINITE, min(max(w.origin.z - scene.surface_height_m, 0.0) / down, INFINITE), down > 0.0);
    let hit = closest(w.origin, w.direction, to_water, w.start_primitive);
    if HAS_AIR_LAMPS {
        see_air_lamps(w, w.origin, w.direction, min(hit.t, to_water), channels_weight(w.channels));
    }
    if hit.primitive != NONE {
        w.origin += hit.t * w.direction;
        w.start_primitive = hit.primitive;
        w.flags &= ~LEADING;
        return AmbientLanding(true, w, lit_point(hit, w.direction, true));
    }
    if down <= 0.0 {
        score(w, channels_weight(w.channels), has(w, SCATTERED_BEFORE), sky_radiance());
        return AmbientLanding(false, w, no_point());
    }
    w.origin = vec3f((w.origin + to_water * w.direction).xy, scene.surface_height_m);
    w.start_primitive = NONE;
    if uniform_number() < external_reflectance(down) {
        w = along(w, flip(w.direction));
    } else {
        w = along(w, refract_into_water(w.direction));
        w.flags &= ~IN_AIR;
        w.channels.value /= scene.refractive_index * scene.refractive_index;
    }
    push_walk(w);
    return AmbientLanding(false, w, no_point());
}

/// On a surface in the water, in the air or in space: scores it and goes on from it.
fn meet_surface_ambient(walk: AmbientWalk, point: SurfacePoint) {
    var w = walk;
    w.flags |= MET_SURFACE;
    let scattered = has(w, SCATTERED_BEFORE);
    if any(point.emission != Spectrum(0.0)) {
        score(w, channels_weight(w.channels), scattered, point.emission);
    }
    if w.events >= max_events() || all(surface_albedo(point) == Spectrum(0.0)) {
        return;
    }
    w.events += 1u;
    w.channels.value *= surface_albedo(point);
    let weight = channels_weight(w.channels);
    let sun = sunlight_on(w, point);
    score(w, weight, scattered, sun);
    if HAS_AIR_LAMPS {
        score_air_lamps_on(w, weight, point);
    }
    let diffuse = diffuse_irradiance(has(w, IN_AIR), w.origin, point) / PI;
    set_reference(weight, point.emission + sun + diffuse);
    let copies = copies_of(w, weight, diffuse);
    w.channels.value *= copies.factor;
    if copies.count == 0u {
        return;
    }
    var i = 0u;
    loop {
        leave_surface(w, point);
        w.flags &= ~LEADING;
        i += 1u;
        if i >= copies.count {
            break;
        }
    }
}

/// Radiance that a surface whose albedo is 1 sends on from the unscattered sun.
fn sunlight_on(w: AmbientWalk, point: SurfacePoint) -> Spectrum {
    if !HAS_SUN {
        return Spectrum(0.0);
    }
    let wet = HAS_SURFACE && !has(w, IN_AIR);
    let towards = select(scene.sun_towards_in_air, scene.sun_towards, wet);
    let scattering_pdf = surface_pdf(point, towards);
    if scattering_pdf <= 0.0 {
        return Spectrum(0.0);
    }
    let reflected = scattering_pdf * surface_factor(point, towards);
    if !wet {
        let blocked = occluded(w.origin, towards, INFINITE, w.start_primitive);
        return select(sun_irradiance_in_air() * reflected, Spectrum(0.0), blocked);
    }
    if !sun_reaches(w.origin, w.start_primitive) {
        return Spectrum(0.0);
    }
    return sun_irradiance() * transmittance_along(w.origin, towards, depth_of(w.origin) / towards.z) * reflected;
}

/// A direction from the surface's own lobes or, in scattering water, around the sun or a lamp in the air.
fn leave_surface(walk: AmbientWalk, point: SurfacePoint) {
    var w = walk;
    let numbers = direction_numbers(w);
    let mixed = HAS_SUN && HAS_SCATTERING && !has(w, IN_AIR);
    var x = -1.0;
    var around_sun = false;
    if mixed {
        around_sun = uniform_number() < SUN_SHARE_SURFACE;
    }
    let from_lamps = HAS_AIR_LAMPS && HAS_SCATTERING && !has(w, IN_AIR);
    var around_lamp = false;
    if from_lamps {
        w.lamp_point = draw_lamp_point();
        around_lamp = uniform_number() < LAMP_SHARE_SURFACE;
    }
    if around_lamp {
        w = along(w, around_air_lamp(w, phase_sample_x(numbers.bits), numbers.v));
    } else if around_sun {
        x = phase_sample_x(numbers.bits);
        w = headed(w, turned_heading(w, true, x, numbers.v));
    } else {
        w = along(w, surface_direction(point, numbers.bits, numbers.v));
    }
    let scattering_pdf = surface_pdf(point, w.direction);
    if scattering_pdf <= 0.0 {
        return;
    }
    if HAS_GLOSS {
        w.channels.value *= surface_factor(point, w.direction);
    }
    var density = scattering_pdf;
    if mixed {
        if x < 0.0 {
            x = sin2_half_to_sun(w.from_sun);
        }
        density = (1.0 - SUN_SHARE_SURFACE) * scattering_pdf + SUN_SHARE_SURFACE * phase_value(x);
    }
    if from_lamps {
        density = mix(density, density_around_air_lamps(w, w.direction), LAMP_SHARE_SURFACE);
    }
    if mixed || from_lamps {
        w.channels.value *= scattering_pdf / density;
    }
    w.flags &= ~LEADING;
    push_walk(w);
}
