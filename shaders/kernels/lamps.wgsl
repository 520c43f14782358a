// Light of the lamps: one lane per pixel, some samples of a batch per dispatch.
// Twin: crates/render/src/integrator/cpu/mod.rs (`Worker::sample`). Checked by: tests/system/gpu.rs.
import package::common::camera::{camera_direction, camera_ray, is_clear, place};
import package::common::direct_lamps::direct_lamps;
import package::common::film::share;
import package::common::lamp_join::vertex_count;
import package::common::lamp_path::lamp_walk;
import package::common::lamp_walk::{FREE, SCATTERED, THROUGH};
import package::common::lane::{LaneWork, lane_end, lane_start};
import package::common::layout::{HAS_SCATTERING, dispatch};
import package::common::rng::{leading, start_draws};
import package::common::settings::max_events;

/// Image points per sample at which unscattered light is seen in clear water.
const DIRECT_POINTS: u32 = 4u;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= dispatch.pixel_count {
        return;
    }
    let work = lane_start(id.x);
    vertex_count = 0u;
    var walks = 0u;
    let clear = is_clear(camera_ray(camera_direction(work.column, work.row, vec2f(0.5))));
    var index = work.first;
    while index < work.last {
        walks += sample_walks(work, index, clear);
        if clear {
            sample_direct(work, index);
        }
        index += 1u;
    }
    lane_end(work, index, walks, vertex_count);
}

/// The walks of one sample; returns their number.
fn sample_walks(work: LaneWork, index: u32, clear: bool) -> u32 {
    start_draws(work.pixel, index, 0u);
    let placed = place(work.column, work.row, leading(0u), leading(1u));
    if placed.factor == 0.0 {
        return 0u;
    }
    let ray = camera_ray(camera_direction(work.column, work.row, placed.offset));
    share = placed.factor;
    var walks = 0u;
    if ray.wet && max_events() > 0u {
        let split = HAS_SCATTERING && is_clear(ray);
        walks = select(1u, 2u, split);
        for (var i = 0u; i < walks; i++) {
            var kind = FREE;
            if !HAS_SCATTERING || (split && i == 0u) {
                kind = THROUGH;
            } else if split {
                kind = SCATTERED;
            }
            lamp_walk(ray, kind);
        }
    }
    if !clear {
        direct_lamps(ray);
    }
    return walks;
}

/// Unscattered light in clear water, at image points of its own.
fn sample_direct(work: LaneWork, index: u32) {
    for (var i = 0u; i < DIRECT_POINTS; i++) {
        start_draws(work.pixel, index * DIRECT_POINTS + i, 2u);
        let placed = place(work.column, work.row, leading(0u), leading(1u));
        if placed.factor != 0.0 {
            share = placed.factor / f32(DIRECT_POINTS);
            direct_lamps(camera_ray(camera_direction(work.column, work.row, placed.offset)));
        }
    }
}
