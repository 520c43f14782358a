// Sun, sky and emitting surfaces: one lane per pixel, some samples of a batch per dispatch.
// Twin: crates/render/src/integrator/cpu/mod.rs (`Worker::sample`). Checked by: tests/system/gpu.rs.
import package::common::ambient_path::ambient_trace;
import package::common::camera::{camera_direction, place};
import package::common::film::{clear_sums, commit_sums, lane, share};
import package::common::layout::{completed, counters, dispatch, scene};
import package::common::rng::{leading, start_draws};

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
    var vertices = 0u;
    for (var index = first; index < last; index++) {
        start_draws(pixel, index, 0u);
        let placed = place(column, row, leading(0u), leading(1u));
        if placed.factor != 0.0 {
            share = placed.factor;
            start_draws(pixel, index, 1u);
            vertices += ambient_trace(camera_direction(column, row, placed.offset));
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
    atomicAdd(&counters.paths, last - first);
    atomicAdd(&counters.vertices, vertices);
    if last < dispatch.batch_samples {
        atomicAdd(&counters.unfinished, 1u);
    }
}
