// Random numbers keyed by (seed, pixel, sample, stream), as bits and as floats.
// Host: crates/render/src/sampling/{rng,sobol,draws}.rs. Checked by: crates/render/src/gpu/functions/numbers.rs.
import package::common::layout::{dispatch, scene};
import package::common::tables::table_word;

const MAX_BATCH: u32 = 4096u;

/// State of xoshiro128++ (Blackman and Vigna 2019).
var<private> rng_state: vec4u;
/// What keys the leading numbers: scrambling and index of the point.
var<private> scramble: u32;
var<private> point_index: u32;
var<private> draws_pixel: u32;

fn hash_mix(v: vec4u) -> vec4u {
    var w = v;
    w.x += w.y * w.w;
    w.y += w.z * w.x;
    w.z += w.x * w.y;
    w.w += w.y * w.z;
    return w;
}

/// Two rounds of the pcg4d hash (Jarzynski and Olano 2020).
fn hash4(key: vec4u) -> vec4u {
    var v = key;
    for (var i = 0u; i < 2u; i++) {
        v = hash_mix(v * 1664525u + 1013904223u);
        v = hash_mix(v ^ (v >> vec4u(16u)));
    }
    return v;
}

fn rng_new(seed_low: u32, seed_high: u32, pixel: u32, sample: u32, stream: u32) -> vec4u {
    var state = hash4(vec4u(seed_low ^ (stream * 0x9e3779b9u), seed_high, pixel, sample));
    if all(state == vec4u(0u)) {
        state.x = 1u;
    }
    return state;
}

fn rotate_left(x: u32, n: u32) -> u32 {
    return (x << n) | (x >> (32u - n));
}

/// The next 32 pseudorandom bits.
fn next_bits() -> u32 {
    var s = rng_state;
    let result = rotate_left(s.x + s.w, 7u) + s.x;
    let t = s.y << 9u;
    s.z ^= s.x;
    s.w ^= s.y;
    s.y ^= s.z;
    s.x ^= s.w;
    s.z ^= t;
    s.w = rotate_left(s.w, 11u);
    rng_state = s;
    return result;
}

/// Bits as a number in (0, 1), never 0 or 1; precise next to 0.
fn unit(bits: u32) -> f32 {
    return min((f32(bits) + 0.5) * 2.3283064e-10, 0.99999994);
}

/// The next pseudorandom number in (0, 1).
fn uniform_number() -> f32 {
    return unit(next_bits());
}

/// Starts the draws of sample `index` of the dispatch's batch at `pixel`; `stream` separates the paths of a sample.
fn start_draws(pixel: u32, index: u32, stream: u32) {
    draws_pixel = pixel;
    scramble = scramble_of(stream);
    point_index = index;
    continue_draws(pixel, index, stream);
}

/// Starts the pseudorandom numbers alone.
fn continue_draws(pixel: u32, index: u32, stream: u32) {
    // Their key: seed xor 0x5851f42d4c957f2d.
    rng_state = rng_new(
        dispatch.seed_low ^ 0x4c957f2du,
        dispatch.seed_high ^ 0x5851f42du,
        pixel,
        dispatch.batch * MAX_BATCH + index,
        2u * stream + 1u,
    );
}

/// What scrambles the leading numbers of `stream`.
fn scramble_of(stream: u32) -> u32 {
    let state = rng_state;
    rng_state = rng_new(dispatch.seed_low, dispatch.seed_high, draws_pixel, dispatch.batch, 2u * stream);
    let bits = next_bits();
    rng_state = state;
    return bits;
}

/// A hash of 32 bits (Wellons 2018).
fn lowbias32(value: u32) -> u32 {
    var x = value;
    x = (x ^ (x >> 16u)) * 0x7feb352du;
    x = (x ^ (x >> 15u)) * 0x846ca68bu;
    return x ^ (x >> 16u);
}

/// Nested uniform scrambling (Laine and Karras 2011, constants of Vegdahl 2021).
fn owen(bits: u32, seed: u32) -> u32 {
    var x = reverseBits(bits);
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return reverseBits(x);
}

/// Leading number `dimension` of the sample, a scrambled Sobol point, as bits.
fn leading_bits(dimension: u32) -> u32 {
    var bits = 0u;
    var rest = point_index;
    if rest != 0u {
        loop {
            bits ^= table_word(scene.sobol_table + 32u * dimension + firstTrailingBit(rest));
            rest &= rest - 1u;
            if rest == 0u {
                break;
            }
        }
    }
    return owen(bits, lowbias32(scramble + dimension * 0x9e3779b9u));
}

/// Leading number `dimension` in (0, 1).
fn leading(dimension: u32) -> f32 {
    return unit(leading_bits(dimension));
}
