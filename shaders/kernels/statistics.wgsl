// Sums over the held film: of the mean radiance, and of variance over level for the estimate of the error, which takes a
// second run with the mean of the first.
// Twin: crates/render/src/film.rs (`Film::mean`, `Film::relative_error`). Checked by:
// crates/render/src/gpu/twins/picture.rs.
import package::common::picture::{DEVIATIONS, TOTAL, held_at, partial_sums, picture};

const LANES: u32 = 64u;

var<workgroup> lane_sums: array<vec4f, LANES>;

@compute @workgroup_size(64)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    var sum = vec4f(0.0);
    for (var pixel = id.x; pixel < picture.pixels; pixel += LANES * groups.x) {
        let mean = held_at(TOTAL, pixel);
        sum += vec4f(mean, relative_variance(mean, held_at(DEVIATIONS, pixel)));
    }
    lane_sums[lane] = sum;
    for (var step = LANES / 2u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if lane < step {
            lane_sums[lane] += lane_sums[lane + step];
        }
    }
    if lane == 0u {
        partial_sums[group.x] = lane_sums[0];
    }
}

/// Variance of a pixel's mean over its level, summed over the channels; 0 before the second batch.
fn relative_variance(mean: vec3f, deviations: vec3f) -> f32 {
    if picture.batches < 2.0 {
        return 0.0;
    }
    let variance = deviations / (picture.samples_before * (picture.batches - 1.0));
    let level = mean * mean + 1e-4 * picture.mean * picture.mean;
    var sum = 0.0;
    for (var k = 0u; k < 3u; k++) {
        if level[k] > 0.0 {
            sum += variance[k] / level[k];
        }
    }
    return sum;
}
