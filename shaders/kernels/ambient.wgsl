// Sun, sky and emitting surfaces: one lane per pixel, some samples of a batch per dispatch.
// Twin: crates/render/src/integrator/cpu/mod.rs (`Worker::sample`). Checked by: tests/system/gpu.rs.
import package::common::ambient_path::{ambient_start, ambient_step};
import package::common::ambient_walk::pending;
import package::common::camera::{camera_direction, place};
import package::common::film::share;
import package::common::lane::{LaneWork, lane_end, lane_start};
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
    pending = 0u;
    // Lanes of a group go on together, each with its own sample.
    loop {
        if pending == 0u && work.first + paths < work.last {
            start_sample(work, work.first + paths);
            paths += 1u;
        }
        if pending > 0u {
            ambient_step();
            vertices += 1u;
        }
        if pending == 0u && work.first + paths >= work.last {
            break;
        }
    }
    lane_end(work, work.first + paths - select(0u, 1u, pending > 0u), paths, vertices);
}

/// Starts the walks of a sample, unless nothing can be seen where it looks.
fn start_sample(work: LaneWork, index: u32) {
    start_draws(work.pixel, index, 0u);
    let placed = place(work.column, work.row, leading(0u), leading(1u));
    if placed.factor != 0.0 {
        share = placed.factor;
        start_draws(work.pixel, index, 1u);
        ambient_start(camera_direction(work.column, work.row, placed.offset));
    }
}
