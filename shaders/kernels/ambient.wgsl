// Sun, sky and emitting surfaces: one lane per pixel (or for pixel after pixel, MANY_PIXELS), some samples of a batch
// per dispatch.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::ambient_queue::{first_numbers, enqueue, dequeue, origin_of};
import package::common::ambient_path::{ambient_start, ambient_step};
import package::common::ambient_walk::pending;
import package::common::film::share;
import package::common::lane::{LaneWork, lane_end, lane_start};
import package::common::layout::{MANY_PIXELS, dispatch};
import package::common::sight::{continue_sample, sight, start_sample};

/// Stream of the walks' numbers.
const STREAM: u32 = 1u;

/// The pixel at work, and how many the lane has made before it.
var<private> work: LaneWork;
var<private> pixels_made: u32;
/// Segments of the lane's walks, for the statistics.
var<private> segment_count: u32;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= dispatch.pixel_count {
        return;
    }
    work = lane_start(id.x);
    pixels_made = 0u;
    segment_count = 0u;
    let each = work.last - work.first;
    var all = each;
    if MANY_PIXELS {
        all *= 1u + (dispatch.pixel_count - 1u - id.x) / dispatch.lanes;
    }
    var done = 0u;
    if all > 0u {
        loop {
            let count = min(all - done, dispatch.queued);
            enqueue_samples(id.x, each, done, count);
            let made = trace_samples(id.x, each, done, count);
            done += made;
            if made < count || done >= all {
                break;
            }
        }
    }
    lane_end(work, work.first + done - each * pixels_made, done, segment_count);
}

/// Of the lane that starts with pixel `id` of the dispatch's, `each` samples to a pixel: makes `count` samples from number
/// `first` on ready for their walks.
fn enqueue_samples(id: u32, each: u32, first: u32, count: u32) {
    var i = 0u;
    loop {
        var sample = first + i;
        var pixel = dispatch.first_pixel + id;
        if MANY_PIXELS {
            pixel += sample / each * dispatch.lanes;
            sample %= each;
        }
        start_sample(pixel, work.first + sample, 0u);
        let seen = sight(pixel);
        start_sample(pixel, work.first + sample, STREAM);
        enqueue(i, seen.origin, vec4f(seen.direction, seen.factor), first_numbers());
        i += 1u;
        if i >= count {
            break;
        }
    }
}

/// The walks of the samples that are held; returns the number of samples that are done. Lanes of a group go on together,
/// each with its own sample.
fn trace_samples(id: u32, each: u32, first: u32, count: u32) -> u32 {
    var begun = 0u;
    pending = 0u;
    loop {
        if pending == 0u && begun < count {
            var sample = first + begun;
            if MANY_PIXELS {
                if sample / each > pixels_made {
                    lane_end(work, work.last, 0u, 0u);
                    pixels_made += 1u;
                    work = lane_start(id + pixels_made * dispatch.lanes);
                }
                sample %= each;
            }
            start_walks(work.first + sample, begun);
            begun += 1u;
        }
        if pending > 0u {
            ambient_step();
            segment_count += 1u;
        }
        if pending == 0u && begun >= count {
            break;
        }
    }
    // What a driver has cut is not done.
    return begun - select(0u, 1u, pending > 0u);
}

/// Starts the walks of a sample, unless nothing can be seen where it looks.
fn start_walks(index: u32, queued_at: u32) {
    let held = dequeue(queued_at);
    if held.w != 0.0 {
        share = held.w;
        continue_sample(work.pixel, index, STREAM);
        ambient_start(origin_of(queued_at), held.xyz);
    }
}
