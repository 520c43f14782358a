// Functions of the lamps' light over tables of inputs: row i of the scratch buffer holds four numbers, of which function
// `max_events` of the list below makes up to four, in the film. Random numbers are those of pixel i.
// Checked by: crates/render/src/gpu/twins/{lamps,surfaces}.rs.
import package::common::bridge::{bridge, bridge_draw, bridge_turn, extra_place, quarters_about};
import package::common::bvh::SurfacePoint;
import package::common::camera::{CameraRay, End, NOTHING, camera_ray};
import package::common::film::lane;
import package::common::lamp_landing::worth_of;
import package::common::lamp_walk::{Target, equiangular_beside, equiangular_density, equiangular_sample, land, lit_length2, lit_length2_of, survival_in_water, survival_of_walk, target_count, targets, walk, walk_start};
import package::common::layout::{NONE, dispatch, film, scene, scratch};
import package::common::medium::{spectral_after, spectral_scatter, spectral_start};
import package::common::rng::{start_draws, uniform_number};
import package::common::settings::{lamp_strategies, max_events};
import package::common::tables::lamp_position;
import package::common::unfold::segment_factor;
import package::common::ways::{Junction, trail_leave, trail_push, trail_root, trail_start, ways_contribution};
import package::probe::inputs::{direction_of, in_box, three_numbers};

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= dispatch.pixel_count {
        return;
    }
    lane = id.x;
    start_draws(id.x, 0u, 0u);
    let result = evaluate(scratch[id.x]);
    film[4u * id.x] = result.x;
    film[4u * id.x + 1u] = result.y;
    film[4u * id.x + 2u] = result.z;
    film[4u * id.x + 3u] = result.w;
}

fn evaluate(a: vec4f) -> vec4f {
    switch max_events() {
        case 0u: {
            let end = in_box(three_numbers());
            return vec4f(segment_factor(in_box(a.xyz), end, NONE), 0.0, 0.0, 0.0);
        }
        case 1u: {
            return way_of_row(a);
        }
        case 2u: {
            let offset = 0.1 * vec3f(a.x - 0.5, a.y - 0.5, 0.0);
            let ray = ray_along(normalize(lamp_position(1) + offset), 0.5 + 3.0 * a.z);
            let law = equiangular_beside(Target(1u, false, 1.0), ray, 0.5);
            return vec4f(law.share, equiangular_sample(law, a.w), equiangular_density(law, a.w * ray.length), 0.0);
        }
        case 3u: {
            let ray = camera_ray(vec3f(select(-1.0, 1.0, a.x < 0.5), 0.0, 0.0));
            walk_start(ray);
            lit_length2 = lit_length2_of(ray);
            walk.origin = in_box(a.xyz);
            let in_water = survival_in_water(a.w);
            walk.best = 10.0 * a.x;
            let in_veil = survival_of_walk(a.w);
            land();
            walk.met_surface = true;
            return vec4f(in_water, survival_of_walk(a.w), in_veil, walk.best);
        }
        default: {
            return worth_of_row(a);
        }
    }
}

fn ray_along(direction: vec3f, length: f32) -> CameraRay {
    return CameraRay(true, vec3f(0.0), direction, length, 1.0, false, End(NOTHING, length, NONE, vec2f(0.0)));
}

/// A walk of up to three vertices that starts in the water or on a surface, and a bridge of up to three, its roll chosen,
/// to the disk.
fn way_of_row(a: vec4f) -> vec4f {
    let rooted = a.x < 0.5;
    let count = 1u + u32(3.0 * a.z);
    var spectral = spectral_start(lamp_strategies(), a.y);
    var position = vec3f(0.2, 0.0, 0.0);
    var length = 0.0;
    trail_start();
    for (var i = 0u; i < count; i++) {
        if rooted && i == 0u {
            trail_root(position, length, 1.0, a.w < 0.7, a.w < 0.3);
        } else {
            let u = three_numbers();
            let t = 0.1 + 0.4 * u.x;
            position += t * direction_of(u.y, u.z);
            length += t;
            spectral = spectral_scatter(spectral, scene.lamp_sigma, scene.lamp_ln_sigma, t);
            trail_push(position, length, 1.0);
        }
        if i + 1u < count {
            trail_leave(0.05 + uniform_number());
        }
    }
    let order = u32(4.0 * uniform_number());
    let end = lamp_position(0);
    if !bridge_draw(position, end, order) {
        return vec4f(-1.0);
    }
    for (var i = 0u; i <= order; i++) {
        scratch[extra_place(i)].y = 0.9;
        bridge.crossing *= 0.9;
    }
    let axis = normalize(end - position);
    var worths: vec4f;
    for (var turns = 0u; turns < 4u; turns++) {
        let beam = select(0.0, 1.0, quarters_about(bridge.emission, axis, turns).x < -0.3);
        worths[turns] = beam * (1.5 + quarters_about(bridge.first, axis, turns).z);
    }
    let factor = bridge_turn(axis, uniform_number(), worths) * (2.0 + bridge.first.z);
    return vec4f(factor * ways_contribution(spectral, Junction(0.3, end, 0.01)), f32(order));
}

/// A scout's landing in view of the disk and of the point lamp's mirror image.
fn worth_of_row(a: vec4f) -> vec4f {
    walk_start(ray_along(vec3f(1.0, 0.0, 0.0), 1.0));
    walk.origin = in_box(a.xyz);
    walk.unscattered = a.w < 0.3;
    walk.mirrored = a.w > 0.8;
    walk.spectral = spectral_after(spectral_start(lamp_strategies(), a.w), u32(6.0 * a.w), 4.0 * a.w);
    targets[0] = Target(0u, false, 1.0);
    targets[1] = Target(1u, true, 1.0);
    target_count = 2u;
    let u = three_numbers();
    let normal = direction_of(u.x, u.y);
    return vec4f(worth_of(SurfacePoint(normal, normal, vec3f(u.z, 0.5, 0.2), vec3f(0.0))), 0.0, 0.0, 0.0);
}
