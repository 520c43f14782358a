// Phase function and its inverse CDF as piecewise cubics. Twin: crates/media/src/phase/fast/.
// Checked by: crates/render/src/gpu/twins/numbers.rs.
import package::common::layout::{scene, word_f32, words};

/// Largest key of a table, the float below 1/2, as bits.
const LARGEST_KEY: u32 = 0x3effffffu;
/// Bits of the mantissa that remain inside a block: eight blocks to the octave.
const INNER_BITS: u32 = 20u;
const INNER_MASK: u32 = 0xfffffu;

/// The tabulated function at a key, min(argument, 1 − argument), of its low or high end. The table at `table` holds,
/// per end, the smallest key's bits and the first block; then the places of the blocks and of the cells.
fn table_at(table: u32, key: f32, high: bool) -> f32 {
    let end = table + select(0u, 2u, high);
    let smallest = words[end];
    let bits = clamp(bitcast<u32>(key), smallest, LARGEST_KEY);
    let block = words[words[table + 4u] + words[end + 1u] + (bits >> INNER_BITS) - (smallest >> INNER_BITS)];
    let split = block & 15u;
    let inner = bits & INNER_MASK;
    let cell = words[table + 5u] + 4u * ((block >> 4u) + (inner >> (INNER_BITS - split)));
    let place = (inner << split) & INNER_MASK;
    let t = bitcast<f32>(0x3f800000u | (place << 3u)) - 1.0;
    return (word_f32(cell) + t * word_f32(cell + 1u)) + t * t * (word_f32(cell + 2u) + t * word_f32(cell + 3u));
}

/// Phase function, 1/sr, at x = sin²(θ/2).
fn phase_value(x: f32) -> f32 {
    let high = x >= 0.5;
    return max(table_at(scene.value_table, max(select(x, 1.0 - x, high), 0.0), high), 0.0);
}

/// x = sin²(θ/2) drawn from the phase function, from 32 random bits.
fn phase_sample_x(bits: u32) -> f32 {
    let high = bits >= 0x80000000u;
    let key = (f32(select(bits, ~bits, high)) + 0.5) * 2.3283064e-10;
    return clamp(table_at(scene.sample_table, key, high), 7.5231638e-37, 1.0);
}
