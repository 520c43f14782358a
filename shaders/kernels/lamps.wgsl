// Light of the lamps: one lane per pixel, some samples of a batch per dispatch.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::camera::{CameraRay, camera_ray, choose_image_point, is_clear};
import package::common::direct_lamps::direct_lamps;
import package::common::film::share;
import package::common::lamp_connect::vertex_count;
import package::common::lamp_flight::{FREE, SCATTERED, THROUGH};
import package::common::lamp_path::lamp_walk;
import package::common::lane::{LaneWork, lane_end, lane_start};
import package::common::layout::{GIVEN_RAYS, HAS_SCATTERING, MANY_PIXELS, dispatch};
import package::common::lens::{camera_look, choose_on_opening};
import package::common::rng::{leading, start_draws};
import package::common::settings::max_events;
import package::common::sight::{sight, start_sample};
import package::common::spectrum::{choose_wavelengths, wavelength_number};

/// Image points per sample at which unscattered light is seen in clear water.
const DIRECT_POINTS: u32 = 4u;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= dispatch.pixel_count {
        return;
    }
    var pixel = id.x;
    loop {
        make_pixel(pixel);
        pixel += dispatch.lanes;
        if !MANY_PIXELS || pixel >= dispatch.pixel_count {
            break;
        }
    }
}

/// The samples of pixel `id` of the dispatch's.
fn make_pixel(id: u32) {
    let work = lane_start(id);
    vertex_count = 0u;
    var walks = 0u;
    let clear = !GIVEN_RAYS && is_clear_pixel(work);
    var index = work.first;
    if index < work.last {
        loop {
            walks += sample(work, index, clear);
            index += 1u;
            if index >= work.last {
                break;
            }
        }
    }
    lane_end(work, index, walks, vertex_count);
}

/// Whether unscattered light has image points of its own: by the centre of the pixel, because a choice that hung on the
/// sample's own ray would count light twice, or not at all, where rays of one pixel differ.
fn is_clear_pixel(work: LaneWork) -> bool {
    let look = camera_look(work.column, work.row, vec2f(0.5), vec2f(0.0));
    return is_clear(camera_ray(look.origin, look.direction));
}

/// One sample; returns the number of its walks.
fn sample(work: LaneWork, index: u32, clear: bool) -> u32 {
    start_sample(work.pixel, index, 0u);
    choose_wavelengths(wavelength_number());
    let seen = sight(work.pixel);
    let ray = camera_ray(seen.origin, seen.direction);
    share = seen.factor;
    var walks = 0u;
    if seen.factor != 0.0 && ray.wet && max_events() > 0u {
        walks = sample_walks(ray);
    }
    sample_direct(work, index, clear, ray);
    return walks;
}

/// The walks along a camera ray; returns their number.
fn sample_walks(ray: CameraRay) -> u32 {
    let split = HAS_SCATTERING && is_clear(ray);
    let walks = select(1u, 2u, split);
    var i = 0u;
    loop {
        var kind = FREE;
        if !HAS_SCATTERING || (split && i == 0u) {
            kind = THROUGH;
        } else if split {
            kind = SCATTERED;
        }
        lamp_walk(ray, kind);
        i += 1u;
        if i >= walks {
            break;
        }
    }
    return walks;
}

/// Unscattered light: along the camera ray of the walks, in clear water at image points of its own.
fn sample_direct(work: LaneWork, index: u32, clear: bool, of_walks: CameraRay) {
    let points = select(1u, DIRECT_POINTS, clear);
    var ray = of_walks;
    var i = 0u;
    loop {
        if clear {
            start_draws(work.pixel, index * DIRECT_POINTS + i, 2u);
            choose_wavelengths(wavelength_number());
            let image_point = choose_image_point(work.column, work.row, leading(0u), leading(1u));
            share = image_point.factor / f32(DIRECT_POINTS);
            let look = camera_look(work.column, work.row, image_point.offset, choose_on_opening());
            ray = camera_ray(look.origin, look.direction);
        }
        if share != 0.0 {
            direct_lamps(ray);
        }
        i += 1u;
        if i >= points {
            break;
        }
    }
}
