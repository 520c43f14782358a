// Where a sample looks and what keys its numbers: through a point of its pixel, or along a ray that is given.
// Host: crates/render/src/rays.rs. Checked by: tests/system/irradiance_sensors.rs, tests/system/gpu.rs.
import package::common::camera::choose_image_point;
import package::common::layout::{GIVEN_RAYS, dispatch, rays, scene};
import package::common::lens::{camera_look, choose_on_opening};
import package::common::rng::{continue_draws, leading, start_draws};

/// Origin and direction of a sample, and the factor of what is seen there (0: nothing).
struct Sight {
    origin: vec3f,
    direction: vec3f,
    factor: f32,
}

/// What keys the numbers of a sample: a pixel, and the sample's number there.
struct Key {
    pixel: u32,
    index: u32,
}

/// Of sample `index` of a pixel, or of the ray that has its place in the film.
fn key(pixel: u32, index: u32) -> Key {
    if GIVEN_RAYS {
        return Key(dispatch.ray_key, dispatch.first_ray + pixel);
    }
    return Key(pixel, index);
}

/// Starts the numbers of a sample, its pseudorandom ones with `stream`.
fn start_sample(pixel: u32, index: u32, stream: u32) {
    let k = key(pixel, index);
    start_draws(k.pixel, k.index, stream);
}

/// Starts its pseudorandom numbers alone.
fn continue_sample(pixel: u32, index: u32, stream: u32) {
    let k = key(pixel, index);
    continue_draws(k.pixel, k.index, stream);
}

/// Where the sample looks whose numbers, of stream 0, were started.
fn sight(pixel: u32) -> Sight {
    if GIVEN_RAYS {
        return Sight(rays[0].xyz, rays[1u + pixel].xyz, 1.0);
    }
    let column = pixel % scene.width;
    let row = pixel / scene.width;
    let image_point = choose_image_point(column, row, leading(0u), leading(1u));
    let look = camera_look(column, row, image_point.offset, choose_on_opening());
    return Sight(look.origin, look.direction, image_point.factor);
}
