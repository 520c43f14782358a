//! Lanes in plain Rust, for every processor: what the functions of the shading language do in each of them.
//!
//! The letter before a name is the kind: f floats, i and u whole numbers with and without sign, b conditions. Functions of
//! numbers are those of WGSL; `Xs` sets all lanes, `Xsel` takes `a` where `m` holds, `Xkeep` the same
//! for what is stored over `b`, `X2Y` converts, `XbitsY` keeps the
//! bits. Reads beyond the end give the last word or row, writes beyond it are left out; memory is never empty.

use crate::elementary::{lane_functions, lane_numbers_in};
use crate::tree::*;

/// Lanes of a group.
pub const LANES: usize = 8;

/// Floats, whole numbers with and without sign, conditions.
#[derive(Clone, Copy)]
pub struct F([f32; LANES]);
#[derive(Clone, Copy)]
pub struct I([i32; LANES]);
#[derive(Clone, Copy)]
pub struct U([u32; LANES]);
#[derive(Clone, Copy)]
pub struct B([bool; LANES]);

#[inline]
fn zip<A: Copy, T: Copy, R>(a: [A; LANES], b: [T; LANES], f: impl Fn(A, T) -> R) -> [R; LANES] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

crate::elementary::elementary!(#[cfg(all())]);
crate::tree::tree_functions!(#[cfg(all())]);
crate::elementary::keep_as_chosen!(#[cfg(all())]);

lane_functions! {
    #[cfg(all())]

    fn fs(x: f32) -> F {
        F([x; LANES])
    }

    fn us(x: u32) -> U {
        U([x; LANES])
    }

    fn is(x: i32) -> I {
        I([x; LANES])
    }

    fn bs(x: bool) -> B {
        B([x; LANES])
    }

    fn fadd(a: F, b: F) -> F {
        F(zip(a.0, b.0, |a, b| a + b))
    }

    fn fsub(a: F, b: F) -> F {
        F(zip(a.0, b.0, |a, b| a - b))
    }

    fn fmul(a: F, b: F) -> F {
        F(zip(a.0, b.0, |a, b| a * b))
    }

    fn fdiv(a: F, b: F) -> F {
        F(zip(a.0, b.0, |a, b| a / b))
    }

    fn fmin(a: F, b: F) -> F {
        F(zip(a.0, b.0, |a, b| if a < b { a } else { b }))
    }

    fn fmax(a: F, b: F) -> F {
        F(zip(a.0, b.0, |a, b| if a > b { a } else { b }))
    }

    fn fused(a: F, b: F, c: F) -> F {
        fadd(fmul(a, b), c)
    }

    fn fsqrt(a: F) -> F {
        F(a.0.map(f32::sqrt))
    }

    fn ffloor(a: F) -> F {
        F(a.0.map(f32::floor))
    }

    fn fround(a: F) -> F {
        F(a.0.map(f32::round_ties_even))
    }

    fn fabs(a: F) -> F {
        F(a.0.map(f32::abs))
    }

    fn fneg(a: F) -> F {
        F(a.0.map(|x| -x))
    }

    fn feq(a: F, b: F) -> B {
        B(zip(a.0, b.0, |a, b| a == b))
    }

    fn fne(a: F, b: F) -> B {
        B(zip(a.0, b.0, |a, b| a != b))
    }

    fn flt(a: F, b: F) -> B {
        B(zip(a.0, b.0, |a, b| a < b))
    }

    fn fle(a: F, b: F) -> B {
        B(zip(a.0, b.0, |a, b| a <= b))
    }

    fn fsel(m: B, a: F, b: F) -> F {
        F(std::array::from_fn(|i| if m.0[i] { a.0[i] } else { b.0[i] }))
    }

    fn uadd(a: U, b: U) -> U {
        U(zip(a.0, b.0, |a, b| a.wrapping_add(b)))
    }

    fn usub(a: U, b: U) -> U {
        U(zip(a.0, b.0, |a, b| a.wrapping_sub(b)))
    }

    fn umul(a: U, b: U) -> U {
        U(zip(a.0, b.0, |a, b| a.wrapping_mul(b)))
    }

    fn uand(a: U, b: U) -> U {
        U(zip(a.0, b.0, |a, b| a & b))
    }

    fn uor(a: U, b: U) -> U {
        U(zip(a.0, b.0, |a, b| a | b))
    }

    fn uxor(a: U, b: U) -> U {
        U(zip(a.0, b.0, |a, b| a ^ b))
    }

    fn umin(a: U, b: U) -> U {
        U(zip(a.0, b.0, |a, b| a.min(b)))
    }

    fn umax(a: U, b: U) -> U {
        U(zip(a.0, b.0, |a, b| a.max(b)))
    }

    fn ueq(a: U, b: U) -> B {
        B(zip(a.0, b.0, |a, b| a == b))
    }

    fn ushl(a: U, b: U) -> U {
        U(zip(a.0, b.0, |a, b| a.checked_shl(b).unwrap_or(0)))
    }

    fn unot(a: U) -> U {
        U(a.0.map(|x| !x))
    }

    fn usel(m: B, a: U, b: U) -> U {
        U(std::array::from_fn(|i| if m.0[i] { a.0[i] } else { b.0[i] }))
    }

    fn iadd(a: I, b: I) -> I {
        I(zip(a.0, b.0, |a, b| a.wrapping_add(b)))
    }

    fn isub(a: I, b: I) -> I {
        I(zip(a.0, b.0, |a, b| a.wrapping_sub(b)))
    }

    fn iand(a: I, b: I) -> I {
        I(zip(a.0, b.0, |a, b| a & b))
    }

    fn ieq(a: I, b: I) -> B {
        B(zip(a.0, b.0, |a, b| a == b))
    }

    fn ishl(a: I, b: U) -> I {
        I(zip(a.0, b.0, |a, b| a.checked_shl(b).unwrap_or(0)))
    }

    fn ushr(a: U, b: U) -> U {
        U(zip(a.0, b.0, |a, b| a.checked_shr(b).unwrap_or(0)))
    }

    fn ishr(a: I, b: U) -> I {
        I(zip(a.0, b.0, |a, b| a >> b.min(31)))
    }

    fn bsel(m: B, a: B, b: B) -> B {
        B(std::array::from_fn(|i| if m.0[i] { a.0[i] } else { b.0[i] }))
    }

    fn band(a: B, b: B) -> B {
        B(zip(a.0, b.0, |a, b| a & b))
    }

    fn bor(a: B, b: B) -> B {
        B(zip(a.0, b.0, |a, b| a | b))
    }

    fn bxor(a: B, b: B) -> B {
        B(zip(a.0, b.0, |a, b| a ^ b))
    }

    fn bandnot(a: B, b: B) -> B {
        B(zip(a.0, b.0, |a, b| !a & b))
    }

    fn any(a: B) -> bool {
        a.0 != [false; LANES]
    }

    fn i2u(a: I) -> U {
        U(a.0.map(i32::cast_unsigned))
    }

    fn u2i(a: U) -> I {
        I(a.0.map(u32::cast_signed))
    }

    fn fbitsu(a: F) -> U {
        U(a.0.map(f32::to_bits))
    }

    fn ubitsf(a: U) -> F {
        F(a.0.map(f32::from_bits))
    }

    fn i2f(a: I) -> F {
        F(a.0.map(|x| x as f32))
    }

    fn f2i(a: F) -> I {
        I(a.0.map(|x| x as i32))
    }

    fn u2f(a: U) -> F {
        F(a.0.map(|x| x as f32))
    }

    fn f2u(a: F) -> U {
        U(a.0.map(|x| x as u32))
    }

    fn words_of(a: U) -> [u32; LANES] {
        a.0
    }

    fn of_words(a: [u32; LANES]) -> U {
        U(a)
    }

    fn lanes_of(m: B) -> u32 {
        (0..LANES).fold(0, |bits, lane| bits | u32::from(m.0[lane]) << lane)
    }

    fn ugather(from: &[u32], at: U) -> U {
        let last = from.len() as u32 - 1;
        U(at.0.map(|i| from[i.min(last) as usize]))
    }

    fn ugather_rows(from: &[u32], at: U) -> [U; 4] {
        let last = from.len() as u32 / 4 - 1;
        let first = at.0.map(|i| 4 * i.min(last) as usize);
        std::array::from_fn(|k| U(first.map(|i| from[i + k])))
    }

    fn uscatter_rows(m: B, to: &mut [u32], at: U, v: [U; 4]) {
        for lane in lane_numbers_in(lanes_of(m)) {
            let first = 4 * at.0[lane] as usize;
            if let Some(row) = to.get_mut(first..first + 4) {
                for (word, part) in row.iter_mut().zip(v) {
                    *word = part.0[lane];
                }
            }
        }
    }
}
