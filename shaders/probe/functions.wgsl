// Shared functions over tables of inputs: row i of the scratch buffer holds four numbers, of which function
// `max_events` of the list below makes up to four, in the film. Checked by: crates/render/src/gpu/functions/.
import package::common::bvh::closest;
import package::common::film::lane;
import package::common::interface::{external_reflectance, internal_reflectance, refract_into_water};
import package::common::layout::{INFINITE, NONE, dispatch, film, scratch};
import package::common::lens::camera_look;
import package::common::math::{angle_of, cosine_hemisphere, expm1, ln_1p, minus_ln, sin2_half, turn};
import package::common::order::{order_ln_tail, order_sample, order_sample_scattered, scattered_share};
import package::common::phase::{phase_sample_x, phase_value};
import package::common::rng::{leading_bits, next_bits, start_draws};
import package::common::settings::max_events;
import package::common::surface::surface_point;
import package::probe::inputs::direction_of;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= dispatch.pixel_count {
        return;
    }
    lane = id.x;
    let result = evaluate(scratch[id.x]);
    film[4u * id.x] = result.x;
    film[4u * id.x + 1u] = result.y;
    film[4u * id.x + 2u] = result.z;
    film[4u * id.x + 3u] = result.w;
}

fn evaluate(a: vec4f) -> vec4f {
    switch max_events() {
        case 0u: {
            start_draws(bitcast<u32>(a.x), bitcast<u32>(a.y), bitcast<u32>(a.z));
            let first = next_bits();
            return vec4f(bitcast<f32>(first), bitcast<f32>(next_bits()), bitcast<f32>(leading_bits(2u)), bitcast<f32>(leading_bits(5u)));
        }
        case 1u: {
            return vec4f(phase_value(a.x), phase_sample_x(bitcast<u32>(a.y)), 0.0, 0.0);
        }
        case 2u: {
            return vec4f(expm1(a.x), ln_1p(a.y), minus_ln(a.z), angle_of(a.w, a.x));
        }
        case 3u: {
            let d = direction_of(a.x, a.y);
            return vec4f(turn(d, a.z, a.w), sin2_half(d, turn(d, a.z, a.w)));
        }
        case 4u: {
            return vec4f(cosine_hemisphere(direction_of(a.x, a.y), a.z, a.w), 0.0);
        }
        case 5u: {
            return vec4f(internal_reflectance(a.x), external_reflectance(a.x), refract_into_water(direction_of(a.y, a.z)).zx);
        }
        case 6u: {
            let d = direction_of(a.x, a.y);
            let hit = closest(vec3f(0.0), d, INFINITE, NONE);
            if hit.primitive == NONE {
                return vec4f(-1.0, 0.0, 0.0, 0.0);
            }
            let point = surface_point(hit, d);
            return vec4f(hit.t, point.shading_normal.xy, point.reflectance.y);
        }
        case 7u: {
            return vec4f(f32(order_sample(a.x, a.y)), f32(order_sample_scattered(a.x, a.y)), scattered_share(a.x), order_ln_tail(u32(a.z)));
        }
        default: {
            let on_opening = 1.4 * a.wz - vec2f(0.7);
            let look = camera_look(bitcast<u32>(a.x), bitcast<u32>(a.y), a.zw, on_opening);
            return vec4f(select(look.origin, look.direction, max_events() == 8u), 0.0);
        }
    }
}
