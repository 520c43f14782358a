// Phase function and its inverse CDF as piecewise cubics.
// Host: crates/media/src/phase/fast/. Checked by: crates/render/src/gpu/functions/numbers.rs.
import package::common::layout::scene;
import package::common::tables::{stored_row, table_row_f32, table_word};

/// Largest key of a table, the float below 1/2, as bits.
const LARGEST_KEY: u32 = 0x3effffffu;
/// Bits of the mantissa that remain inside a block: eight blocks to the octave.
const INNER_BITS: u32 = 20u;
const INNER_MASK: u32 = 0xfffffu;

/// The tabulated function at a key, min(argument, 1 − argument), of its low or high end. `ends` holds, per end, the
/// smallest key's bits and the first block; `blocks` is the word of the first block, `cells` the row of the first cell.
fn table_at(ends: vec4u, blocks: u32, cells: u32, key: f32, high: bool) -> f32 {
    let smallest = select(ends.x, ends.z, high);
    let bits = clamp(bitcast<u32>(key), smallest, LARGEST_KEY);
    let block = table_word(blocks + select(ends.y, ends.w, high) + blocks_between(smallest, bits));
    return cubic_at(table_row_f32(cells + cell_of(block, bits)), block, bits);
}

/// The same of the low end, wherever its table lies.
fn stored_table_at(ends: vec4u, blocks: u32, cells: u32, key: f32) -> f32 {
    let bits = clamp(bitcast<u32>(key), ends.x, LARGEST_KEY);
    let word = blocks + ends.y + blocks_between(ends.x, bits);
    let block = stored_row(word >> 2u)[word & 3u];
    return cubic_at(bitcast<vec4f>(stored_row(cells + cell_of(block, bits))), block, bits);
}

/// Blocks from that of the smallest key to that of a key, both as bits.
fn blocks_between(smallest: u32, bits: u32) -> u32 {
    return (bits >> INNER_BITS) - (smallest >> INNER_BITS);
}

/// Cell of a key of a block.
fn cell_of(block: u32, bits: u32) -> u32 {
    return (block >> 4u) + ((bits & INNER_MASK) >> (INNER_BITS - (block & 15u)));
}

/// The cubic of a cell at a key.
fn cubic_at(cell: vec4f, block: u32, bits: u32) -> f32 {
    let inside = ((bits & INNER_MASK) << (block & 15u)) & INNER_MASK;
    let t = bitcast<f32>(0x3f800000u | (inside << 3u)) - 1.0;
    return (cell.x + t * cell.y) + t * t * (cell.z + t * cell.w);
}

/// Phase function, 1/sr, at x = sin²(θ/2).
fn phase_value(x: f32) -> f32 {
    let high = x >= 0.5;
    let key = max(select(x, 1.0 - x, high), 0.0);
    return max(table_at(scene.value_ends, scene.value_blocks, scene.value_cells, key, high), 0.0);
}

/// Its mean over the disk of the sun, whose middle is at x. In the place of its high end the record says where the table ends and what
/// the mean is in the middle.
fn sun_phase_value(x: f32) -> f32 {
    if !(x < bitcast<f32>(scene.sun_value_ends.z)) {
        return phase_value(x);
    }
    return max(stored_table_at(scene.sun_value_ends, scene.sun_value_blocks, scene.sun_value_cells, max(x, 0.0)), 0.0);
}

/// The most that the mean is.
fn sun_phase_peak() -> f32 {
    return bitcast<f32>(scene.sun_value_ends.w);
}

/// x = sin²(θ/2) drawn from the phase function, from 32 random bits.
fn phase_sample_x(bits: u32) -> f32 {
    let high = bits >= 0x80000000u;
    let key = (f32(select(bits, ~bits, high)) + 0.5) * 2.3283064e-10;
    let x = table_at(scene.sample_ends, scene.sample_blocks, scene.sample_cells, key, high);
    return clamp(x, 7.5231638e-37, 1.0);
}
