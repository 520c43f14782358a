// Which lamps, and mirror images of lamps, a camera walk is joined to, and where they are.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::camera::CameraRay;
import package::common::interface::mirror;
import package::common::lamp_walk::{LONGEST, up_to_free_path};
import package::common::layout::{HAS_GROUPS, HAS_SURFACE, INFINITE, LampGroup, scene};
import package::common::light::{lamp_relative_intensity, lamp_sample_point};
import package::common::medium::largest;
import package::common::rng::uniform_number;
import package::common::settings::{lamp_count, lamp_group_count};
import package::common::tables::{lamp_group, lamp_intensity, lamp_mirror_share, lamp_position, lamp_radius};

const MOST_LAMPS: u32 = 4u;
const EVEN_SHARE: f32 = 0.1;
/// Distance of a lamp, by those that it is the difference of, below which it is of no account.
const LEAST_DISTANCE: f32 = 1e-6;
/// Where a number is drawn that might have been given.
const NO_NUMBER: f32 = -1.0;

/// A lamp or its mirror image, as paths are joined to it; `weight` is the reciprocal of its probability.
struct Target {
    lamp: u32,
    mirrored: bool,
    weight: f32,
}

var<private> targets: array<Target, 4>;
var<private> target_count: u32;

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

/// How far along a ray lamps are judged that it starts at `from_origin` from, m.
fn reach_of_ray(ray: CameraRay, from_origin: vec3f) -> f32 {
    if !ray.wet {
        return 0.0;
    }
    let reach = up_to_free_path(ray.length);
    return select(reach, max(-dot(from_origin, ray.direction), 0.0), reach >= LONGEST);
}

/// What a lamp can bring to a camera ray: its irradiance at the end of the ray, or one free path into the water, or, where
/// nothing ends or dims the ray, where it is closest to the lamp.
fn lamp_estimate(lamp: u32, ray: CameraRay) -> f32 {
    let from_origin = ray.origin - lamp_position(lamp);
    let reach = reach_of_ray(ray, from_origin);
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

/// The same of all lamps of a group, wherever their beams go.
fn group_estimate(group: LampGroup, ray: CameraRay) -> f32 {
    let from_origin = ray.origin - group.centre;
    let reach = reach_of_ray(ray, from_origin);
    let offset = from_origin + reach * ray.direction;
    let least2 = LEAST_DISTANCE * LEAST_DISTANCE * (dot(from_origin, from_origin) + reach * reach);
    let distance2 = max(dot(offset, offset) + group.spread2, least2);
    if distance2 == 0.0 {
        return 0.0;
    }
    return group.intensity * exp(-min(scene.c_min * sqrt(distance2), 80.0)) / distance2;
}

/// Share of an estimate in all of them, and of what is chosen however little it can bring.
fn share_of(estimate: f32, total: f32, even: f32) -> f32 {
    if total > 0.0 {
        return EVEN_SHARE * even + (1.0 - EVEN_SHARE) * estimate / total;
    }
    return even;
}

/// Chooses four lamps by what their groups, and they in their groups, can bring: with one comb of numbers, so that lamps of
/// groups in which no tooth falls are not looked at.
fn choose_in_groups(ray: CameraRay, number: f32) {
    var total = 0.0;
    for (var g = 0u; g < lamp_group_count(); g++) {
        total += group_estimate(lamp_group(g), ray);
    }
    var next = uniform_number();
    var sum = 0.0;
    for (var g = 0u; g < lamp_group_count(); g++) {
        let group = lamp_group(g);
        let even = f32(group.count) / f32(lamp_count());
        let expected = f32(MOST_LAMPS) * share_of(group_estimate(group, ray), total, even);
        if next < sum + expected {
            next = choose_of_group(group, ray, number, next, sum, expected);
        }
        sum += expected;
    }
}

/// Chooses those lamps of a group, which is `expected` teeth wide from `start` on, in which teeth fall from `first` on; the tooth after them.
fn choose_of_group(group: LampGroup, ray: CameraRay, number: f32, first: f32, start: f32, expected: f32) -> f32 {
    let end = group.first + group.count;
    var total = 0.0;
    for (var i = group.first; i < end; i++) {
        total += lamp_estimate(i, ray);
    }
    var next = first;
    var sum = start;
    for (var i = group.first; i < end; i++) {
        let own = expected * share_of(lamp_estimate(i, ray), total, 1.0 / f32(group.count));
        sum += own;
        // The last one ends where the group does, however sums are rounded.
        let upto = select(sum, start + expected, i + 1u == end);
        var chosen = 0.0;
        while next < upto {
            chosen += 1.0;
            next += 1.0;
        }
        if chosen > 0.0 {
            aim(i, chosen / own, number);
        }
    }
    return next;
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
    if HAS_GROUPS {
        choose_in_groups(ray, number);
        return;
    }
    // All are one group.
    let all = LampGroup(vec3f(0.0), 0.0, 0.0, 0.0, 0u, count);
    choose_of_group(all, ray, number, uniform_number(), 0.0, f32(MOST_LAMPS));
}

/// Square of the distance of `point` from the nearest lamp, m².
fn nearest2_to(point: vec3f) -> f32 {
    var nearest2 = INFINITE;
    if HAS_GROUPS {
        // In every group a lamp is at most so far away.
        var most = INFINITE;
        for (var g = 0u; g < lamp_group_count(); g++) {
            let group = lamp_group(g);
            most = min(most, distance(group.centre, point) + group.reach);
        }
        for (var g = 0u; g < lamp_group_count(); g++) {
            let group = lamp_group(g);
            if distance(group.centre, point) - group.reach <= most {
                nearest2 = nearest2_of(group.first, group.first + group.count, point, nearest2);
            }
        }
        return nearest2;
    }
    return nearest2_of(0u, lamp_count(), point, nearest2);
}

/// The same of the lamps from `first` to before `end`, at most `most`.
fn nearest2_of(first: u32, end: u32, point: vec3f, most: f32) -> f32 {
    var nearest2 = most;
    for (var i = first; i < end; i++) {
        let offset = lamp_position(i) - point;
        nearest2 = min(nearest2, dot(offset, offset));
    }
    return nearest2;
}
