// The sensor's noise: standard normal numbers from the same 64 bits as the host's.
// Host: crates/render/src/sensor.rs (`standard_normal`). Checked by: crates/render/src/gpu/functions/picture.rs.
// 64 bits are a vector of their low and high halves.
import package::common::math::{circle, minus_ln};

/// 2⁻³² and 2⁻⁵³.
const UPPER_UNIT: f32 = 2.3283064365386963e-10;
const UNIT: f32 = 1.1102230246251565e-16;
const GOLDEN: vec2u = vec2u(0x7f4a7c15u, 0x9e3779b9u);
const FIRST_FACTOR: vec2u = vec2u(0x1ce4e5b9u, 0xbf58476du);
const SECOND_FACTOR: vec2u = vec2u(0x133111ebu, 0x94d049bbu);

/// All 64 bits of a product.
fn wide_product(a: u32, b: u32) -> vec2u {
    let a_low = a & 0xffffu;
    let a_high = a >> 16u;
    let b_low = b & 0xffffu;
    let b_high = b >> 16u;
    let low = a_low * b_low;
    let left = a_low * b_high;
    let right = a_high * b_low;
    let middle = (low >> 16u) + (left & 0xffffu) + (right & 0xffffu);
    let high = a_high * b_high + (left >> 16u) + (right >> 16u) + (middle >> 16u);
    return vec2u((low & 0xffffu) | (middle << 16u), high);
}

/// The lower 64 bits of a product.
fn product(a: vec2u, b: vec2u) -> vec2u {
    let low = wide_product(a.x, b.x);
    return vec2u(low.x, low.y + a.x * b.y + a.y * b.x);
}

fn sum(a: vec2u, b: vec2u) -> vec2u {
    let low = a.x + b.x;
    return vec2u(low, a.y + b.y + select(0u, 1u, low < a.x));
}

/// z ^ (z >> n) for n in 1..32.
fn folded(z: vec2u, n: u32) -> vec2u {
    return z ^ vec2u((z.x >> n) | (z.y << (32u - n)), z.y >> n);
}

/// The output function of SplitMix64.
fn mixed(start: vec2u) -> vec2u {
    let first = product(folded(start, 30u), FIRST_FACTOR);
    return folded(product(folded(first, 27u), SECOND_FACTOR), 31u);
}

/// The upper 53 of 64 bits as a number in [0, 1).
fn fraction(bits: vec2u) -> f32 {
    return f32(bits.y) * UPPER_UNIT + f32(bits.x >> 11u) * UNIT;
}

/// A number drawn from the standard normal distribution, a function of the seed's `start` and `index` alone.
fn standard_normal(start: vec2u, index: u32) -> f32 {
    let first = mixed(sum(start, product(vec2u(2u * index, 0u), GOLDEN)));
    let second = mixed(sum(start, product(vec2u(2u * index + 1u, 0u), GOLDEN)));
    let radius = sqrt(2.0 * minus_ln(min(fraction(first) + UNIT, 1.0)));
    return radius * circle(fraction(second)).x;
}
