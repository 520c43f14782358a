// How a camera walk that looks for lamp light moves: segments, the water surface, roulette; and its targets.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::bvh::closest;
import package::common::camera::{BOUNDARY, CameraRay, End, NOTHING, SCATTER, SURFACE};
import package::common::interface::{distance_to_surface, flip, internal_reflectance, mirror};
import package::common::layout::{HAS_MEDIUM, HAS_SCATTERING, HAS_SURFACE, INFINITE, NONE, scene};
import package::common::light::{lamp_relative_intensity, lamp_sample_point};
import package::common::math::{angle_of, expm1, ln_1p, minus_ln, quarter_turns};
import package::common::medium::{ChannelSampling, largest, channels_pass, channels_start, channels_weight, transmittance};
import package::common::rng::{leading, uniform_number};
import package::common::settings::lamp_count;
import package::common::tables::{lamp_intensity, lamp_mirror_share, lamp_position, lamp_radius};

const MOST_LAMPS: u32 = 4u;
const EVEN_SHARE: f32 = 0.1;
/// Volume vertices before which a walk that has met no surface is ended only far from where it has been.
const SURE_VERTICES: u32 = 12u;
/// Roulette sets in where the prospects of a walk fall below the reciprocals of these.
const REACH_IN_WATER: f32 = 3.0;
const REACH_FROM_SURFACE: f32 = 5.0;
/// Roulette of a walk that has met no surface sets in where its prospects fall by this factor below their best.
const FALL: f32 = 10.0;
/// Shares of three lengths of the scene within which a walk is taken to be as close to a lamp as it gets.
const OF_START: f32 = 3.0;
const OF_END: f32 = 0.5;
const OF_RAY: f32 = 0.02;
/// Distance of a lamp, by those that it is the difference of, below which it is of no account.
const LEAST_DISTANCE: f32 = 1e-6;
/// Largest length whose square is a number, m.
const LONGEST: f32 = 1e15;
/// Largest share of first scatterings that are drawn evenly over the angle under which a lamp sees them, and the density
/// of the free flights by theirs from which none are.
const EQUIANGULAR_SHARE: f32 = 0.75;
const DENSE_ENOUGH: f32 = 0.3;
/// Where a number is drawn that might have been given.
const NO_NUMBER: f32 = -1.0;
const SURE_EVENTS: u32 = 1000u;
const LATE_SURVIVAL: f32 = 0.998;

/// How the first segment of a walk ends.
const FREE: u32 = 0u;
const THROUGH: u32 = 1u;
const SCATTERED: u32 = 2u;

struct Walk {
    origin: vec3f,
    direction: vec3f,
    start_primitive: u32,
    mirrored: bool,
    length: f32,
    reflected: f32,
    scatterings: u32,
    events: u32,
    met_surface: bool,
    unscattered: bool,
    channels: ChannelSampling,
    /// Largest prospects so far, before a surface is met.
    best: f32,
}

/// A lamp or its mirror image, as paths are joined to it; `weight` is the reciprocal of its probability.
struct Target {
    lamp: u32,
    mirrored: bool,
    weight: f32,
}

struct Equiangular {
    /// Share of the distances to draw from it.
    share: f32,
    foot: f32,
    height: f32,
    start: f32,
    span: f32,
    length: f32,
}

var<private> walk: Walk;
/// Square of the distance from a lamp, m², beyond which prospects fall.
var<private> lit_length2: f32;
var<private> targets: array<Target, 4>;
var<private> target_count: u32;

fn walk_start(ray: CameraRay) {
    walk = Walk(ray.origin, ray.direction, NONE, false, 0.0, 1.0, 0u, 0u, false, true, channels_start(1u, 0.5), 0.0);
}

fn unfolded(point: vec3f) -> vec3f {
    if HAS_SURFACE && walk.mirrored {
        return mirror(point);
    }
    return point;
}

fn unfolded_direction(direction: vec3f) -> vec3f {
    return select(direction, flip(direction), HAS_SURFACE && walk.mirrored);
}

fn target_centre(aimed: Target) -> vec3f {
    let position = lamp_position(aimed.lamp);
    if HAS_SURFACE && aimed.mirrored {
        return mirror(position);
    }
    return position;
}

/// A point of the lamp or of its mirror image, in unfolded space.
fn lamp_point(aimed: Target) -> vec3f {
    var point = lamp_position(aimed.lamp);
    if lamp_radius(aimed.lamp) > 0.0 {
        let u = uniform_number();
        let v = uniform_number();
        point = lamp_sample_point(aimed.lamp, u, v);
    }
    if HAS_SURFACE && aimed.mirrored {
        return mirror(point);
    }
    return point;
}

/// Adds the lamp or its mirror image to the targets; the first of them by `number`, unless that is NO_NUMBER.
fn aim(lamp: u32, weight: f32, number: f32) {
    let share = lamp_mirror_share(lamp);
    var mirrored = false;
    if share > 0.0 {
        var u = number;
        if target_count > 0u || number == NO_NUMBER {
            u = uniform_number();
        }
        mirrored = u < share;
    }
    let probability = select(1.0 - share, share, mirrored);
    if target_count < MOST_LAMPS {
        targets[target_count] = Target(lamp, mirrored, weight / probability);
        target_count += 1u;
    }
}

/// What a lamp can bring to a camera ray: its irradiance at the end of the ray, or one free path into the water, or, where
/// nothing ends or dims the ray, where it is closest to the lamp.
fn lamp_estimate(lamp: u32, ray: CameraRay) -> f32 {
    let from_origin = ray.origin - lamp_position(lamp);
    var reach = 0.0;
    if ray.wet {
        reach = up_to_free_path(ray.length);
        if reach >= LONGEST {
            reach = max(-dot(from_origin, ray.direction), 0.0);
        }
    }
    let offset = from_origin + reach * ray.direction;
    let radius = lamp_radius(lamp);
    let least2 = LEAST_DISTANCE * LEAST_DISTANCE * (dot(from_origin, from_origin) + reach * reach);
    let distance2 = max(max(dot(offset, offset), radius * radius), least2);
    if distance2 == 0.0 {
        return 0.0;
    }
    let beam = lamp_relative_intensity(lamp, offset / sqrt(max(dot(offset, offset), least2)));
    return largest(lamp_intensity(lamp)) * (0.1 + beam) * exp(-min(scene.c_min * sqrt(distance2), 80.0)) / distance2;
}

/// Chooses, once per walk, the lamps it is joined to: all where there are few, else four by what they can bring. Whether
/// the first is the lamp or its image is told by `number`, unless that is NO_NUMBER.
fn choose_targets(ray: CameraRay, number: f32) {
    target_count = 0u;
    let count = lamp_count();
    if count <= MOST_LAMPS {
        for (var i = 0u; i < count; i++) {
            aim(i, 1.0, number);
        }
        return;
    }
    var total = 0.0;
    for (var i = 0u; i < count; i++) {
        total += lamp_estimate(i, ray);
    }
    let even = EVEN_SHARE / f32(count);
    let all_shares = select(EVEN_SHARE, 1.0, total > 0.0);
    var next = uniform_number();
    var sum = 0.0;
    for (var i = 0u; i < count; i++) {
        let guided = select(0.0, lamp_estimate(i, ray) / max(total, 1e-37), total > 0.0);
        let expected = f32(MOST_LAMPS) * (even + (1.0 - EVEN_SHARE) * guided) / all_shares;
        sum += expected;
        var chosen = 0.0;
        while next < sum {
            chosen += 1.0;
            next += 1.0;
        }
        if chosen > 0.0 {
            aim(i, chosen / expected, number);
        }
    }
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
fn scattered_at(ray: CameraRay, within: vec3f, u: f32) -> f32 {
    let sigma = scene.lamp_sigma;
    let used = vec3u(0u, 1u, 2u) < vec3u(walk.channels.count);
    let density = dot(select(vec3f(0.0), sigma / within, used), vec3f(1.0)) / f32(walk.channels.count);
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
        t = min(-ln_1p(-clamp(left / others, 0.0, 1.0) * within[chosen]) / sigma[chosen], ray.length);
    }
    if others < 1.0 {
        var even = 0.0;
        for (var i = 0u; i < target_count; i++) {
            let law = equiangular_beside(targets[i], ray, density);
            even += law.share / f32(target_count) * equiangular_density(law, t);
        }
        let relative = even * within / sigma * exp(min(sigma * t, vec3f(80.0)));
        add_ln_density(log(vec3f(others) + relative));
    }
    return t;
}

/// Multiplies the densities of the strategies by factors given as logarithms.
fn add_ln_density(ln: vec3f) {
    let s = vec3u(0u, 1u, 2u) < vec3u(walk.channels.count);
    walk.channels.ln_density = select(walk.channels.ln_density, walk.channels.ln_density + ln, s);
}

/// The end of the camera ray's first segment in water and its effect on the weights.
fn first_end(ray: CameraRay, kind: u32) -> End {
    if !HAS_MEDIUM {
        return ray.end;
    }
    if !HAS_SCATTERING || kind == THROUGH {
        walk.channels.value *= transmittance(ray.length);
        walk.length += ray.length;
        return ray.end;
    }
    let sigma = scene.lamp_sigma;
    let depth = sigma * ray.length;
    let within = max(-vec3f(expm1(-depth.x), expm1(-depth.y), expm1(-depth.z)), vec3f(1e-30));
    var u = leading(2u);
    if kind == FREE {
        let chance = within[walk.channels.chosen];
        if u >= chance {
            walk.channels = channels_pass(walk.channels, sigma, ray.length);
            walk.length += ray.length;
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
        t = minus_ln(u) / scene.lamp_sigma[walk.channels.chosen];
    }
    let end = free_end(t);
    if HAS_MEDIUM && (end.kind == SURFACE || end.kind == BOUNDARY) {
        walk.channels = channels_pass(walk.channels, scene.lamp_sigma, end.t);
        walk.length += end.t;
    }
    return end;
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

/// Goes on to a scattering; its effect on the weights is left out.
fn go_to_scattering(t: f32) {
    walk.origin += t * walk.direction;
    if HAS_SURFACE {
        walk.origin.z = min(walk.origin.z, scene.surface_height_m);
    }
    walk.start_primitive = NONE;
    walk.length += t;
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

/// Russian roulette by what the walk can still bring.
fn survives() -> bool {
    let survival = survival_of_walk(largest(channels_weight(walk.channels)));
    if survival >= 1.0 {
        return true;
    }
    if !(survival > 0.0) || uniform_number() >= survival {
        return false;
    }
    walk.channels.value /= survival;
    return true;
}

/// Probability with which a walk of this weight goes on; 1 or more: for certain. Where free flights are long a walk
/// that has met no surface leaves the lamps behind, and what it brings from there is little beside what it has brought.
fn survival_of_walk(weight: f32) -> f32 {
    let prospects = prospects_of_walk(weight);
    if walk.met_surface {
        return capped_importance(REACH_FROM_SURFACE * prospects);
    }
    walk.best = max(walk.best, prospects);
    let beside_best = FALL * prospects / walk.best;
    if walk.scatterings <= SURE_VERTICES {
        return beside_best;
    }
    return min(beside_best, capped_importance(REACH_IN_WATER * prospects));
}

/// The same for a walk before its first surface after many scatterings, whatever it has brought.
fn survival_in_water(weight: f32) -> f32 {
    return capped_importance(REACH_IN_WATER * prospects_of_walk(weight));
}

fn capped_importance(importance: f32) -> f32 {
    return min(importance, select(1.0, LATE_SURVIVAL, walk.events > SURE_EVENTS));
}

/// Estimate of what a walk of this weight can still bring, relative to what one of weight 1 brings from close to a lamp.
fn prospects_of_walk(weight: f32) -> f32 {
    let nearest2 = nearest2_to(walk.origin);
    return weight * exp(-min(0.5 * scene.c_min * sqrt(nearest2), 80.0)) / (1.0 + nearest2 / lit_length2);
}

/// Square of the distance from the nearest lamp, m², within which a walk along `ray` is close to it: a length of the
/// scene, so that walks end alike whatever the unit.
fn lit_length2_of(ray: CameraRay) -> f32 {
    let of_ray = OF_RAY * up_to_free_path(ray.length);
    let near = OF_START * OF_START * nearest2_to(ray.origin) + of_ray * of_ray;
    if ray.end.kind != SURFACE {
        return near;
    }
    let of_end2 = OF_END * OF_END * nearest2_to(ray.origin + ray.length * ray.direction);
    return near + of_end2 * exp(-min(4.0 * scene.c_min * sqrt(of_end2), 80.0));
}

/// After the first landing prospects are judged by the lamp's distance from there.
fn land() {
    lit_length2 = max(lit_length2, OF_END * OF_END * nearest2_to(walk.origin));
}

fn up_to_free_path(length: f32) -> f32 {
    return min(length, 1.0 / max(scene.c_min, 1.0 / LONGEST));
}

/// Square of the distance of `point` from the nearest lamp, m².
fn nearest2_to(point: vec3f) -> f32 {
    var nearest2 = INFINITE;
    for (var i = 0u; i < lamp_count(); i++) {
        let offset = lamp_position(i) - point;
        nearest2 = min(nearest2, dot(offset, offset));
    }
    return nearest2;
}
