// Sun, sky and emitting surfaces: one lane per pixel, some samples of a batch per dispatch.
// Twin: crates/render/src/integrator/cpu/mod.rs (`Worker::sample`). Checked by: tests/system/gpu.rs.
import package::common::ambient_path::ambient_trace;
import package::common::camera::{camera_direction, place};
import package::common::film::share;
import package::common::lane::{lane_end, lane_start};
import package::common::layout::dispatch;
import package::common::rng::{leading, start_draws};

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= dispatch.pixel_count {
        return;
    }
    let work = lane_start(id.x);
    var paths = 0u;
    var vertices = 0u;
    var index = work.first;
    while index < work.last {
        start_draws(work.pixel, index, 0u);
        let placed = place(work.column, work.row, leading(0u), leading(1u));
        if placed.factor != 0.0 {
            share = placed.factor;
            start_draws(work.pixel, index, 1u);
            vertices += ambient_trace(camera_direction(work.column, work.row, placed.offset));
        }
        paths += 1u;
        index += 1u;
    }
    lane_end(work, index, paths, vertices);
}
