// Sums over the held film, tile by tile: of the mean radiance, and of variance over level for the estimate of the
// error, which takes a second run with the mean of the first. A pixel's level is drawn to the other pixels of its tile
// by its noise.
// Host: crates/render/src/film.rs (`Film::mean`) and crates/render/src/film/error.rs. Checked by:
// crates/render/src/gpu/functions/picture.rs.
import package::common::layout::Spectrum;
import package::common::picture::{DEVIATIONS, TOTAL, held_at, partial_sums, picture};

const LANES: u32 = 64u;
/// Edge of the tiles, pixels.
const TILE: u32 = 8u;
/// Share of the picture's squared mean that is added to a pixel's squared level.
const FLOOR: f32 = 1e-4;

/// The pixels from (`left`, `top`) to before (`right`, `bottom`).
struct Tile {
    left: u32,
    top: u32,
    right: u32,
    bottom: u32,
    pixels: f32,
    mean: Spectrum,
    variance: Spectrum,
    /// Sum of squared deviations from the mean.
    deviations: Spectrum,
}

var<workgroup> lane_sums: array<vec4f, LANES>;

@compute @workgroup_size(64)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let height = picture.pixels / picture.width;
    let columns = (picture.width + TILE - 1u) / TILE;
    let rows = (height + TILE - 1u) / TILE;
    var sum = vec4f(0.0);
    for (var i = id.x; i < columns * rows; i += LANES * groups.x) {
        let corner = TILE * vec2u(i % columns, i / columns);
        let tile = tile_at(corner, min(corner + TILE, vec2u(picture.width, height)));
        sum += vec4f(tile.mean * tile.pixels, relative_variance(tile));
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

fn tile_at(first: vec2u, end: vec2u) -> Tile {
    var tile = Tile(first.x, first.y, end.x, end.y, 0.0, Spectrum(0.0), Spectrum(0.0), Spectrum(0.0));
    let size = end - first;
    tile.pixels = f32(size.x * size.y);
    for (var y = tile.top; y < tile.bottom; y++) {
        for (var x = tile.left; x < tile.right; x++) {
            let pixel = y * picture.width + x;
            tile.mean += held_at(TOTAL, pixel) / tile.pixels;
            tile.variance += variance_at(pixel) / tile.pixels;
        }
    }
    for (var y = tile.top; y < tile.bottom; y++) {
        for (var x = tile.left; x < tile.right; x++) {
            let deviation = held_at(TOTAL, y * picture.width + x) - tile.mean;
            tile.deviations += deviation * deviation;
        }
    }
    return tile;
}

/// Variance of a pixel's mean; 0 before the second batch.
fn variance_at(pixel: u32) -> Spectrum {
    if picture.batches < 2.0 {
        return Spectrum(0.0);
    }
    return held_at(DEVIATIONS, pixel) / (picture.samples_before * (picture.batches - 1.0));
}

/// Variance over squared level, summed over pixels and channels.
fn relative_variance(tile: Tile) -> f32 {
    var sum = 0.0;
    for (var y = tile.top; y < tile.bottom; y++) {
        for (var x = tile.left; x < tile.right; x++) {
            let pixel = y * picture.width + x;
            let variance = variance_at(pixel);
            let level = level_of(tile, held_at(TOTAL, pixel), variance);
            let square = level * level + FLOOR * picture.mean * picture.mean;
            for (var k = 0u; k < 3u; k++) {
                if square[k] > 0.0 {
                    sum += variance[k] / square[k];
                }
            }
        }
    }
    return sum;
}

/// Level of a pixel with this mean and variance of the mean.
fn level_of(tile: Tile, mean: Spectrum, variance: Spectrum) -> Spectrum {
    let others = tile.pixels - 1.0;
    if others < 2.0 {
        return mean;
    }
    let deviation = mean - tile.mean;
    let around = tile.mean - deviation / others;
    let noise = tile.variance + (tile.variance - variance) / others;
    let deviations = tile.deviations - deviation * deviation * tile.pixels / others;
    let spread = max(deviations / (others - 1.0) - noise, Spectrum(0.0));
    let all = spread + variance;
    let own = select(Spectrum(1.0), spread / all, all > Spectrum(0.0));
    return around + own * (mean - around);
}
