// Light of the lamps that scatters nowhere in the water: lamp, first surface, camera; and lamps that the camera sees.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::bvh::closest;
import package::common::surface::SurfacePoint;
import package::common::camera::{BOUNDARY, SURFACE, CameraRay, end_point};
import package::common::film::add_light;
import package::common::gloss::{surface_albedo, surface_direction, surface_factor, surface_pdf};
import package::common::interface::{distance_to_surface, flip, internal_reflectance, is_above};
import package::common::lamp_connect::emitted;
import package::common::lamp_targets::{NO_NUMBER, Target, choose_targets, lamp_point, target_count, targets};
import package::common::layout::{HAS_DISKS, HAS_GROUPS, HAS_SURFACE, INFINITE, NONE, Spectrum, scene};
import package::common::light::{lamp_facing_area, lamp_radiance_along};
import package::common::layer_tables::BY_SCATTERING;
import package::common::layers::{way_along, way_between};
import package::common::medium::{transmittance, transmittance_along};
import package::common::rng::{next_bits, uniform_number};
import package::common::settings::{lamp_count, lamp_group_count, max_events};
import package::common::tables::{lamp_film_layer, lamp_group, lamp_intensity, lamp_level, lamp_position, lamp_radius};
import package::common::unfold::segment_factor;

/// How much wider groups of lamps are, squared, than their lamps reach, so that no lamp is missed for rounding.
const SEEN: f32 = 1.01;
/// Distance from a surface, in radii, below which a lamp's disk is also looked for in a drawn direction.
const LARGE: f32 = 4.0;

/// The lamps' light along `ray` that does not scatter in the water.
fn direct_lamps(ray: CameraRay) {
    see_lamps(ray);
    if max_events() == 0u || !ray.wet || ray.end.kind != SURFACE {
        return;
    }
    let point = end_point(ray.end, ray.direction);
    if all(surface_albedo(point) == Spectrum(0.0)) {
        return;
    }
    let position = ray.origin + ray.end.t * ray.direction;
    choose_targets(ray, NO_NUMBER);
    if target_count == 0u {
        return;
    }
    // First every lamp is joined, then the disks close by are looked for in one drawn direction: one loop, so that the
    // way to the lamp is traced in one place.
    var any_large = false;
    var drawn = vec3f(0.0);
    var i = 0u;
    loop {
        let meets = HAS_DISKS && i >= target_count;
        if HAS_DISKS && i == target_count {
            let bits = next_bits();
            drawn = surface_direction(point, bits, uniform_number());
        }
        let aimed = targets[select(i, i - target_count, meets)];
        let large = is_large(aimed.lamp, position);
        any_large = any_large || large;
        let line = line_to_lamp(aimed, position, drawn, meets);
        if line.length > 0.0 && (large || !meets) {
            let light = ray.entry_factor * straight_light(ray, point, aimed, position, line, large);
            add_light(lamp_film_layer(aimed.lamp), lamp_level(aimed.lamp), true, false, light);
        }
        i += 1u;
        if i >= select(1u, 2u, any_large) * target_count {
            break;
        }
    }
}

/// A straight way to a point of a lamp, in unfolded space; of length 0 where there is none.
struct LineToLamp {
    end: vec3f,
    towards: vec3f,
    length: f32,
}

/// The way to a point of the lamp, or the one along `drawn` to its disk.
fn line_to_lamp(aimed: Target, position: vec3f, drawn: vec3f, meets: bool) -> LineToLamp {
    if HAS_DISKS && meets {
        let disk = lamp_radiance_along(aimed.lamp, position, drawn, distance_to_surface(position, drawn));
        return LineToLamp(position + disk.t * drawn, drawn, select(0.0, disk.t, disk.met && !aimed.mirrored));
    }
    let end = lamp_point(aimed);
    let length = distance(position, end);
    return LineToLamp(end, (end - position) / length, length);
}

/// Whether the disk of a lamp is looked for in a drawn direction as well.
fn is_large(lamp: u32, position: vec3f) -> bool {
    let reach = LARGE * lamp_radius(lamp);
    let offset = lamp_position(lamp) - position;
    return dot(offset, offset) < reach * reach;
}

/// Light from the lamp point where `line` ends. A large disk is found in two ways, which share by the balance heuristic.
fn straight_light(ray: CameraRay, point: SurfacePoint, aimed: Target, position: vec3f, line: LineToLamp, large: bool) -> Spectrum {
    let scattering_pdf = surface_pdf(point, line.towards);
    let relative = emitted(aimed, -line.towards);
    if scattering_pdf <= 0.0 || relative == 0.0 {
        return Spectrum(0.0);
    }
    let open = segment_factor(position, line.end, ray.end.primitive);
    if open == 0.0 {
        return Spectrum(0.0);
    }
    var density = line.length * line.length / scattering_pdf;
    if large && is_above(position) == is_above(line.end) {
        density += open * lamp_facing_area(aimed.lamp, -line.towards);
    }
    let factor = aimed.weight * relative * open / density;
    return factor * lamp_intensity(aimed.lamp) * surface_albedo(point) * surface_factor(point, line.towards) * transmittance_to(ray, position, line);
}

/// Transmittance of the way from the camera to `position` and along `line` to the lamp.
fn transmittance_to(ray: CameraRay, position: vec3f, line: LineToLamp) -> Spectrum {
    if HAS_LAYERS {
        let depth = way_along(ray.origin, ray.direction, ray.end.t, BY_SCATTERING).depth + way_between(position, line.end, BY_SCATTERING).depth;
        return exp(-min(depth, Spectrum(200.0)));
    }
    return transmittance(ray.end.t + line.length);
}

/// Disk lamps that the camera looks at, straight or in the underside of the water surface.
fn see_lamps(ray: CameraRay) {
    if !HAS_DISKS || !ray.wet {
        return;
    }
    see_lamps_along(ray.origin, ray.direction, ray.length, Spectrum(1.0), ray.entry_factor);
    if !HAS_SURFACE || ray.end.kind != BOUNDARY {
        return;
    }
    let reflectance = internal_reflectance(ray.direction.z);
    if reflectance == 0.0 {
        return;
    }
    let origin = vec3f((ray.origin + ray.length * ray.direction).xy, scene.surface_height_m);
    let direction = flip(ray.direction);
    let hit = closest(origin, direction, INFINITE, NONE);
    let before = transmittance_along(ray.origin, ray.direction, ray.length);
    see_lamps_along(origin, direction, hit.t, before, reflectance * ray.entry_factor);
}

fn see_lamps_along(origin: vec3f, direction: vec3f, length: f32, before: Spectrum, factor: f32) {
    for (var g = 0u; g < select(1u, lamp_group_count(), HAS_GROUPS); g++) {
        var first = 0u;
        var end = lamp_count();
        if HAS_GROUPS {
            let group = lamp_group(g);
            let offset = group.centre - origin;
            let beside = offset - clamp(dot(offset, direction), 0.0, length) * direction;
            first = group.first;
            end = select(first, first + group.count, dot(beside, beside) <= SEEN * group.reach * group.reach);
        }
        for (var i = first; i < end; i++) {
            let disk = lamp_radiance_along(i, origin, direction, length);
            if disk.met {
                let light = factor * disk.radiance * before * transmittance_along(origin, direction, disk.t);
                add_light(lamp_film_layer(i), lamp_level(i), false, false, light);
            }
        }
    }
}
