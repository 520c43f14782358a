// What a lane of a kernel makes: some samples of one pixel; and how it ends, so that no sample is lost unseen.
// Host: crates/render/src/gpu/dispatches.rs (`run_block`, `check_completed`). Checked by:
// crates/render/src/gpu/faults.rs.
import package::common::film::{commit_sums, lane, load_sums, lost_light};
import package::common::layout::{MANY_PIXELS, completed, counters, dispatch, scene};
import package::common::settings::{is_forced, loop_probe, start_settings};

/// The samples `first..last` of the dispatch's batch at `pixel`.
struct LaneWork {
    pixel: u32,
    column: u32,
    row: u32,
    first: u32,
    last: u32,
}

/// Starts a lane with pixel `id` of the dispatch's.
fn lane_start(id: u32) -> LaneWork {
    lane = id;
    if MANY_PIXELS {
        lane = id % dispatch.lanes;
    }
    start_settings(id);
    let pixel = dispatch.first_pixel + id;
    load_sums(pixel);
    let first = completed[pixel];
    let last = min(first + dispatch.samples, dispatch.batch_samples);
    return LaneWork(pixel, pixel % scene.width, pixel / scene.width, first, last);
}

/// Ends the lane, which has made all samples before `reached`: keeps its light and what it counted, unless its loops
/// were cut and the host can repeat it with fewer samples.
fn lane_end(work: LaneWork, reached: u32, paths: u32, vertices: u32) {
    // A driver that limits the loops of an invocation ends this one early too.
    var probe = 0u;
    while probe < loop_probe() {
        probe += 1u;
    }
    if probe < loop_probe() || reached < work.last {
        atomicAdd(&counters.exhausted, 1u);
        if !is_forced() {
            atomicAdd(&counters.unfinished, 1u);
            return;
        }
        atomicAdd(&counters.cut_paths, 1u);
        // Half a sum may be any number.
        lost_light = 0u;
    }
    commit_sums(work.pixel);
    // A single sample that does not fit counts as made, and above as cut.
    let made = select(reached, work.last, is_forced());
    completed[work.pixel] = made;
    atomicAdd(&counters.paths, paths);
    atomicAdd(&counters.vertices, vertices);
    if lost_light > 0u {
        atomicAdd(&counters.not_finite, lost_light);
    }
    if made < dispatch.batch_samples {
        atomicAdd(&counters.unfinished, 1u);
    }
}
