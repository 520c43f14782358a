// Light of the lamps: one lane per pixel, some samples of a batch per dispatch.
// Twin: crates/render/src/integrator/cpu/mod.rs (`Worker::sample`). Checked by: tests/system/gpu.rs.
import package::common::camera::{camera_direction, camera_ray, is_clear, place};
import package::common::film::{clear_sums, commit_sums, lane, share};
import package::common::lamp_join::vertex_count;
import package::common::lamp_path::{direct_lamps, lamp_walk};
import package::common::lamp_walk::{FREE, SCATTERED, THROUGH};
import package::common::layout::{HAS_SCATTERING, completed, counters, dispatch, scene};
import package::common::rng::{leading, start_draws};

/// Image points per sample at which unscattered light is seen in clear water.
const DIRECT_POINTS: u32 = 2u;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    lane = id.x;
    if lane >= dispatch.pixel_count {
        return;
    }
    let pixel = dispatch.first_pixel + lane;
    let column = pixel % scene.width;
    let row = pixel / scene.width;
    let first = completed[pixel];
    let last = min(first + dispatch.samples, dispatch.batch_samples);
    clear_sums();
    vertex_count = 0u;
    var walks = 0u;
    let clear = is_clear(camera_ray(camera_direction(column, row, vec2f(0.5))));
    for (var index = first; index < last; index++) {
        walks += sample_walks(pixel, column, row, index, clear);
        if clear {
            sample_direct(pixel, column, row, index);
        }
    }
    // A driver that limits the loops of an invocation ends this one early too.
    var probe = 0u;
    while probe < dispatch.loop_probe {
        probe += 1u;
    }
    if probe < dispatch.loop_probe {
        atomicAdd(&counters.exhausted, 1u);
        if dispatch.forced == 0u {
            atomicAdd(&counters.unfinished, 1u);
            return;
        }
        atomicAdd(&counters.cut_paths, 1u);
    }
    commit_sums(pixel, 1.0 / f32(dispatch.batch_samples));
    completed[pixel] = last;
    atomicAdd(&counters.paths, walks);
    atomicAdd(&counters.vertices, vertex_count);
    if last < dispatch.batch_samples {
        atomicAdd(&counters.unfinished, 1u);
    }
}

/// The walks of one sample; returns their number.
fn sample_walks(pixel: u32, column: u32, row: u32, index: u32, clear: bool) -> u32 {
    start_draws(pixel, index, 0u);
    let placed = place(column, row, leading(0u), leading(1u));
    if placed.factor == 0.0 {
        return 0u;
    }
    let ray = camera_ray(camera_direction(column, row, placed.offset));
    share = placed.factor;
    var walks = 0u;
    if ray.wet && dispatch.max_events > 0u {
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
fn sample_direct(pixel: u32, column: u32, row: u32, index: u32) {
    for (var i = 0u; i < DIRECT_POINTS; i++) {
        start_draws(pixel, index * DIRECT_POINTS + i, 2u);
        let placed = place(column, row, leading(0u), leading(1u));
        if placed.factor != 0.0 {
            share = placed.factor / f32(DIRECT_POINTS);
            direct_lamps(camera_ray(camera_direction(column, row, placed.offset)));
        }
    }
}
