// Functions of daylight over tables of inputs: row i of the scratch buffer holds four numbers, of which function
// `max_events` of the list below makes up to four, in the film. Random numbers are those of pixel i.
// Checked by: crates/render/src/gpu/twins/daylight.rs.
import package::common::ambient_flight::draw_flight;
import package::common::ambient_walk::{AmbientWalk, along, light_ahead, light_on_surface, sin2_half_to_sun, turned_walk};
import package::common::bvh::SurfacePoint;
import package::common::camera::{BOUNDARY, End, NOTHING, SURFACE};
import package::common::daylight::{attenuation_integral, attenuation_sample, field_irradiance, field_scattered, field_sun_share, scattered_sunlight};
import package::common::film::lane;
import package::common::layout::{INFINITE, NONE, dispatch, film, scene, scratch};
import package::common::math::sin2_half;
import package::common::medium::{spectral_start, spectral_weight};
import package::common::rng::start_draws;
import package::common::settings::{ambient_strategies, max_events};
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
            return vec4f(field_scattered(20.0 * a.x, direction_of(a.y, a.z), vec3f(0.01 * a.w)), 0.0);
        }
        case 1u: {
            return vec4f(field_irradiance(20.0 * a.x, 2.0 * a.y - 1.0), 0.0);
        }
        case 2u: {
            return vec4f(field_sun_share(20.0 * a.x, direction_of(a.y, a.z)), 0.0);
        }
        case 3u: {
            let rate = 4.0 * a.y - 1.5;
            // Upwards a segment is no longer than to the surface, where the sun's light is not attenuated.
            let start = 3.0 * a.x + max(-rate, 0.0) * 3.0 * a.z;
            return vec4f(attenuation_integral(vec3f(start), vec3f(rate), 3.0 * a.z).x, attenuation_sample(rate, 3.0 * a.z, a.w), 0.0, 0.0);
        }
        case 4u: {
            let u = three_numbers();
            let origin = below_surface(a.xyz);
            let direction = direction_of(0.49 * u.x, u.y);
            let x = sin2_half(direction, scene.sun_towards);
            return vec4f(scattered_sunlight(origin, direction, 2.0 * a.w, x), 0.0);
        }
        case 5u: {
            let u = three_numbers();
            let normal = direction_of(u.x, u.y);
            let point = SurfacePoint(normal, normal, vec3f(0.3, 0.5, 0.7), vec3f(0.1, 0.0, 0.2));
            let walk = walk_at(below_surface(a.xyz), vec3f(0.6, 0.0, -0.8));
            return vec4f(light_on_surface(walk, End(SURFACE, 2.0 * a.w, 0u, vec2f(0.0)), point), 0.0);
        }
        case 6u: {
            let walk = walk_at(below_surface(a.xyz), direction_of(0.9 * a.y, a.x));
            return vec4f(light_ahead(walk, End(SURFACE, 2.0 * a.w, 0u, vec2f(0.0)), vec3f(0.01)), 0.0);
        }
        case 7u: {
            var end = End(SURFACE, 3.0 * a.z, 0u, vec2f(0.0));
            if a.x > 0.7 {
                end = End(NOTHING, INFINITE, NONE, vec2f(0.0));
            } else if a.x > 0.3 {
                end = End(BOUNDARY, 3.0 * a.z, NONE, vec2f(0.0));
            }
            let walk = walk_at(vec3f(0.0), vec3f(sqrt(1.0 - a.y * a.y), 0.0, a.y));
            let flight = draw_flight(walk, end, scene.ambient_sigma, a.w);
            return vec4f(flight.t, spectral_weight(flight.spectral));
        }
        default: {
            let around = turned_walk(walk_at(vec3f(0.0), vec3f(1.0, 0.0, 0.0)), true, a.x, a.y);
            let further = turned_walk(around, false, a.z, a.w);
            return vec4f(sin2_half_to_sun(around), sin2_half_to_sun(further), 0.0, 0.0);
        }
    }
}

/// A point of the box below the surface.
fn below_surface(u: vec3f) -> vec3f {
    return in_box(u * vec3f(1.0, 1.0, 0.52));
}

fn walk_at(origin: vec3f, direction: vec3f) -> AmbientWalk {
    let walk = AmbientWalk(origin, direction, vec3f(0.0), NONE, 0u, 0u, spectral_start(ambient_strategies(), 0.4));
    return along(walk, direction);
}
