// The segments of a camera walk that looks for lamp light: how far it flies, what ends a segment, the water surface.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::bvh::closest;
import package::common::camera::{BOUNDARY, NOTHING, SCATTER, SURFACE, CameraRay, End};
import package::common::interface::{distance_to_surface, flip, internal_reflectance};
import package::common::lamp_targets::{Target, target_centre, target_count, targets};
import package::common::lamp_walk::walk;
import package::common::layer_distance::distance_of;
import package::common::layer_tables::BY_SCATTERING;
import package::common::layers::{Way, drawn_along, relative_at, way_along};
import package::common::layout::{HAS_LAYERS, HAS_MEDIUM, HAS_SCATTERING, HAS_SURFACE, INFINITE, NONE, Spectrum, scene};
import package::common::math::{angle_of, ln_1p, minus_ln, quarter_turns};
import package::common::medium::{channels_pass, one_minus_exp};
import package::common::rng::{leading, uniform_number};
import package::common::spectrum::lamp_sigma;
import package::common::tables::lamp_radius;

/// Largest share of first scatterings that are drawn evenly over the angle under which a lamp sees them, and the density
/// of the free flights by theirs from which none are.
const EQUIANGULAR_SHARE: f32 = 0.75;
const DENSE_ENOUGH: f32 = 0.3;
/// How the first segment of a walk ends.
const FREE: u32 = 0u;
const THROUGH: u32 = 1u;
const SCATTERED: u32 = 2u;

struct Equiangular {
    /// Share of the distances to draw from it.
    share: f32,
    foot: f32,
    height: f32,
    start: f32,
    span: f32,
    length: f32,
}

/// The distribution of distances along the ray that is even over the angle under which the target sees them, with the
/// share to draw from it where others fall with at most `density` (1/m).
fn equiangular_beside(aimed: Target, ray: CameraRay, density: f32) -> Equiangular {
    let radius = lamp_radius(aimed.lamp);
    let offset = target_centre(aimed) - ray.origin;
    let foot = dot(offset, ray.direction);
    let across = length(offset - foot * ray.direction);
    let height = max(length(vec2f(across, radius)), 1e-6 * length(offset));
    var span = angle_of(height, -foot);
    if ray.length < INFINITE {
        // The angle between the vectors from the lamp to both ends.
        span = angle_of(height * ray.length, height * height + foot * (foot - ray.length));
    }
    var law = Equiangular(0.0, foot, height, angle_of(-foot, height), span, ray.length);
    let enough = DENSE_ENOUGH * equiangular_density(law, clamp(foot, 0.0, ray.length));
    if density < enough {
        law.share = EQUIANGULAR_SHARE * (1.0 - density / enough);
    }
    return law;
}

fn equiangular_sample(law: Equiangular, u: f32) -> f32 {
    let c = quarter_turns((law.start + u * law.span) * 0.63661977);
    return clamp(law.foot + law.height * c.y / max(c.x, 1e-12), 0.0, law.length);
}

fn equiangular_density(law: Equiangular, t: f32) -> f32 {
    let along = t - law.foot;
    return law.height / (law.span * (law.height * law.height + along * along));
}

/// Distance to a scattering on the first segment, as a free flight falls or evenly over the angle under which a lamp sees
/// it; multiplies the densities by what they differ from those of the free flight.
fn scattered_at(ray: CameraRay, within: Spectrum, u: f32) -> f32 {
    let sigma = lamp_sigma();
    let used = vec3u(0u, 1u, 2u) < vec3u(walk.channels.count);
    let density = dot(select(Spectrum(0.0), sigma / within, used), Spectrum(1.0)) / f32(walk.channels.count);
    var t = -1.0;
    var left = u;
    var others = 1.0;
    for (var i = 0u; i < target_count; i++) {
        let law = equiangular_beside(targets[i], ray, density);
        let share = law.share / f32(target_count);
        if t < 0.0 && left < share {
            t = equiangular_sample(law, left / share);
        }
        left -= share;
        others -= share;
    }
    if t < 0.0 {
        let chosen = walk.channels.chosen;
        t = distance_of(ray.origin, ray.direction, ray.length, -ln_1p(-clamp(left / others, 0.0, 1.0) * within[chosen]) / sigma[chosen], BY_SCATTERING);
    }
    if others < 1.0 {
        var even = 0.0;
        for (var i = 0u; i < target_count; i++) {
            let law = equiangular_beside(targets[i], ray, density);
            even += law.share / f32(target_count) * equiangular_density(law, t);
        }
        // The density of a free flight at the same distance.
        var here = sigma;
        var drawn = t;
        if HAS_LAYERS {
            here *= relative_at(ray.origin + t * ray.direction, BY_SCATTERING);
            drawn = drawn_along(ray.origin, ray.direction, t, BY_SCATTERING);
        }
        let relative = even * within / here * exp(min(sigma * drawn, Spectrum(80.0)));
        add_ln_density(log(Spectrum(others) + relative));
    }
    return t;
}

/// Multiplies the densities of the strategies by factors given as logarithms.
fn add_ln_density(ln: Spectrum) {
    let s = vec3u(0u, 1u, 2u) < vec3u(walk.channels.count);
    walk.channels.ln_density = select(walk.channels.ln_density, walk.channels.ln_density + ln, s);
}

/// The end of the camera ray's first segment in water and its effect on the weights.
fn first_end(ray: CameraRay, kind: u32) -> End {
    if !HAS_MEDIUM {
        return ray.end;
    }
    let way = way_along(ray.origin, ray.direction, ray.length, BY_SCATTERING);
    if !HAS_SCATTERING || kind == THROUGH {
        walk.channels.value *= exp(-min(way.depth, Spectrum(200.0)));
        add_length(ray.length, way);
        return ray.end;
    }
    let sigma = lamp_sigma();
    let depth = sigma * way.drawn;
    let within = max(one_minus_exp(depth), Spectrum(1e-30));
    var u = leading(2u);
    if kind == FREE {
        let chance = within[walk.channels.chosen];
        if u >= chance {
            walk.channels = channels_pass(walk.channels, sigma, way.drawn, way.depth);
            add_length(ray.length, way);
            return ray.end;
        }
        u /= chance;
    }
    let t = scattered_at(ray, within, u);
    if kind == SCATTERED {
        add_ln_density(-log(within));
    }
    return End(SCATTER, t, NONE, vec2f(0.0));
}

/// Draws a free flight and finds what ends the segment; passes the weights where nothing scattered.
fn next_end(u: f32) -> End {
    var t = INFINITE;
    if HAS_SCATTERING {
        t = distance_of(walk.origin, walk.direction, INFINITE, minus_ln(u) / lamp_sigma()[walk.channels.chosen], BY_SCATTERING);
    }
    let end = free_end(t);
    if HAS_MEDIUM && (end.kind == SURFACE || end.kind == BOUNDARY) {
        let way = way_along(walk.origin, walk.direction, end.t, BY_SCATTERING);
        walk.channels = channels_pass(walk.channels, lamp_sigma(), way.drawn, way.depth);
        add_length(end.t, way);
    }
    return end;
}

/// Adds a way of `length` m to that of the walk.
fn add_length(length: f32, way: Way) {
    walk.length += length;
    if HAS_LAYERS {
        walk.drawn += way.drawn;
    }
}

/// What ends a segment on which the walk would scatter after `t`.
fn free_end(t: f32) -> End {
    let to_boundary = distance_to_surface(walk.origin, walk.direction);
    let hit = closest(walk.origin, walk.direction, min(t, to_boundary), walk.start_primitive);
    if hit.primitive != NONE {
        return End(SURFACE, hit.t, hit.primitive, hit.local);
    }
    if t < to_boundary {
        return End(SCATTER, t, NONE, vec2f(0.0));
    }
    return End(select(NOTHING, BOUNDARY, to_boundary < INFINITE), to_boundary, NONE, vec2f(0.0));
}

/// Goes on to a scattering along `way`; its effect on the weights is left out.
fn go_to_scattering(t: f32, way: Way) {
    add_length(t, way);
    walk.origin += t * walk.direction;
    if HAS_SURFACE {
        walk.origin.z = min(walk.origin.z, scene.surface_height_m);
    }
    walk.start_primitive = NONE;
    walk.scatterings += 1u;
    walk.events += 1u;
    walk.unscattered = false;
}

/// The underside of the water surface: reflected with its reflectance as the probability.
fn reflect_at_boundary(t: f32) -> bool {
    let reflectance = internal_reflectance(walk.direction.z);
    // Lamp light does not come back from the air, so what is transmitted ends here.
    if reflectance < 1.0 {
        if uniform_number() >= reflectance {
            return false;
        }
    }
    walk.origin = vec3f((walk.origin + t * walk.direction).xy, scene.surface_height_m);
    walk.direction = flip(walk.direction);
    walk.start_primitive = NONE;
    walk.mirrored = !walk.mirrored;
    walk.unscattered = false;
    walk.reflected *= reflectance;
    return true;
}
