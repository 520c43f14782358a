//! Four floats or whole numbers in vectors of 128 bits, for every processor: what the functions of the shading language do
//! in each lane. One text for all instructions: those that come with the architecture, and SSE4.2.
//!
//! The letter before a name is the kind: f floats, i and u whole numbers with and without sign, b conditions. Functions of
//! numbers are those of WGSL; `Xs` sets all lanes, `Xsel` takes `a` where `m` holds, `Xkeep` the same
//! for what is stored over `b`, `X2Y` converts, `XbitsY` keeps the
//! bits. Reads beyond the end give the last word or row, writes beyond it are left out; memory is never empty.

/// Lanes of a group.
pub const LANES: usize = 4;

/// From here on floats are whole numbers.
const WHOLE: f32 = 8_388_608.0;

/// The functions, with an attribute, on `Unit`, a token of the library that stands for its instructions and that `unit()`
/// makes. `$rounds` tells whether they round and convert floats; where not, that is done here.
macro_rules! four_lanes {
    ($rounds:literal, #[$attribute:meta]) => {
        use fearless_simd::{f32x4, i32x4, mask32x4, prelude::*, u32x4};

        pub use super::LANES;
        use super::WHOLE;
        use crate::elementary::{lane_functions, lane_numbers_in};
        use crate::tree::*;

        /// Floats, whole numbers with and without sign, conditions.
        #[derive(Clone, Copy)]
        pub struct F(f32x4<Unit>);
        #[derive(Clone, Copy)]
        pub struct I(i32x4<Unit>);
        #[derive(Clone, Copy)]
        pub struct U(u32x4<Unit>);
        #[derive(Clone, Copy)]
        pub struct B(mask32x4<Unit>);

        crate::elementary::elementary!(#[$attribute]);
        crate::tree::tree_functions!(#[$attribute]);
        crate::elementary::keep_as_chosen!(#[$attribute]);

        lane_functions! {
            #[$attribute]

            fn fs(x: f32) -> F {
                F(f32x4::splat(unit(), x))
            }

            fn us(x: u32) -> U {
                U(u32x4::splat(unit(), x))
            }

            fn is(x: i32) -> I {
                I(i32x4::splat(unit(), x))
            }

            fn bs(x: bool) -> B {
                B(mask32x4::splat(unit(), x))
            }

            fn fadd(a: F, b: F) -> F {
                F(a.0 + b.0)
            }

            fn fsub(a: F, b: F) -> F {
                F(a.0 - b.0)
            }

            fn fmul(a: F, b: F) -> F {
                F(a.0 * b.0)
            }

            fn fdiv(a: F, b: F) -> F {
                F(a.0 / b.0)
            }

            fn fmin(a: F, b: F) -> F {
                F(a.0.min(b.0))
            }

            fn fmax(a: F, b: F) -> F {
                F(a.0.max(b.0))
            }

            fn fused(a: F, b: F, c: F) -> F {
                F(a.0.mul_add(b.0, c.0))
            }

            fn fsqrt(a: F) -> F {
                F(a.0.sqrt())
            }

            fn ffloor(a: F) -> F {
                if $rounds {
                    return F(a.0.floor());
                }
                let nearest = fround(a);
                fsub(nearest, fsel(flt(a, nearest), fs(1.0), fs(0.0)))
            }

            fn fround(a: F) -> F {
                if $rounds {
                    return F(a.0.round_ties_even());
                }
                // Next to 2²³ floats have no room for a fraction.
                let size = fabs(a);
                let rounded = F(fsub(fadd(size, fs(WHOLE)), fs(WHOLE)).0.copysign(a.0));
                fsel(flt(size, fs(WHOLE)), rounded, a)
            }

            fn fabs(a: F) -> F {
                F(a.0.abs())
            }

            fn fneg(a: F) -> F {
                F(-a.0)
            }

            fn feq(a: F, b: F) -> B {
                B(a.0.simd_eq(b.0))
            }

            fn fne(a: F, b: F) -> B {
                B(a.0.simd_ne(b.0))
            }

            fn flt(a: F, b: F) -> B {
                B(a.0.simd_lt(b.0))
            }

            fn fle(a: F, b: F) -> B {
                B(a.0.simd_le(b.0))
            }

            fn fsel(m: B, a: F, b: F) -> F {
                F(m.0.select(a.0, b.0))
            }

            fn uadd(a: U, b: U) -> U {
                U(a.0 + b.0)
            }

            fn usub(a: U, b: U) -> U {
                U(a.0 - b.0)
            }

            fn umul(a: U, b: U) -> U {
                U(a.0 * b.0)
            }

            fn uand(a: U, b: U) -> U {
                U(a.0 & b.0)
            }

            fn uor(a: U, b: U) -> U {
                U(a.0 | b.0)
            }

            fn uxor(a: U, b: U) -> U {
                U(a.0 ^ b.0)
            }

            fn umin(a: U, b: U) -> U {
                U(a.0.min(b.0))
            }

            fn umax(a: U, b: U) -> U {
                U(a.0.max(b.0))
            }

            fn ueq(a: U, b: U) -> B {
                B(a.0.simd_eq(b.0))
            }

            fn ule(a: U, b: U) -> B {
                B(a.0.simd_le(b.0))
            }

            fn ult(a: U, b: U) -> B {
                B(a.0.simd_lt(b.0))
            }

            fn ushl(a: U, b: U) -> U {
                U(a.0 << b.0)
            }

            fn ushr(a: U, b: U) -> U {
                U(a.0 >> b.0)
            }

            fn unot(a: U) -> U {
                U(!a.0)
            }

            fn usel(m: B, a: U, b: U) -> U {
                U(m.0.select(a.0, b.0))
            }

            fn isub(a: I, b: I) -> I {
                I(a.0 - b.0)
            }

            fn iand(a: I, b: I) -> I {
                I(a.0 & b.0)
            }

            fn ieq(a: I, b: I) -> B {
                B(a.0.simd_eq(b.0))
            }

            fn ishl(a: I, b: U) -> I {
                I(a.0 << u2i(b).0)
            }

            fn ishr(a: I, b: U) -> I {
                I(a.0 >> u2i(b).0)
            }

            fn bsel(m: B, a: B, b: B) -> B {
                B(m.0.select(a.0, b.0))
            }

            fn band(a: B, b: B) -> B {
                B(a.0 & b.0)
            }

            fn bor(a: B, b: B) -> B {
                B(a.0 | b.0)
            }

            fn bxor(a: B, b: B) -> B {
                B(a.0 ^ b.0)
            }

            fn bandnot(a: B, b: B) -> B {
                B(!a.0 & b.0)
            }

            fn any(a: B) -> bool {
                a.0.any_true()
            }

            fn i2u(a: I) -> U {
                U(a.0.bitcast())
            }

            fn u2i(a: U) -> I {
                I(a.0.bitcast())
            }

            fn fbitsu(a: F) -> U {
                U(a.0.bitcast())
            }

            fn ubitsf(a: U) -> F {
                F(a.0.bitcast())
            }

            fn i2f(a: I) -> F {
                F(a.0.to_float())
            }

            fn f2i(a: F) -> I {
                I(a.0.to_int())
            }

            fn u2f(a: U) -> F {
                if $rounds {
                    return F(a.0.to_float());
                }
                // Halves of 16 bits are exact; their sum is rounded once.
                let high = i2f(I((a.0 >> 16).bitcast()));
                let low = i2f(u2i(uand(a, us(0xffff))));
                fadd(fmul(high, fs(65536.0)), low)
            }

            fn f2u(a: F) -> U {
                U(a.0.to_int_precise())
            }

            fn words_of(a: U) -> [u32; LANES] {
                a.0.into()
            }

            fn of_words(a: [u32; LANES]) -> U {
                U(a.simd_into(unit()))
            }

            fn lanes_of(m: B) -> u32 {
                m.0.to_bitmask() as u32
            }

            fn ugather(from: &[u32], at: U) -> U {
                let last = from.len() - 1;
                of_words(words_of(at).map(|i| from[last.min(i as usize)]))
            }

            fn ugather_rows(from: &[u32], at: U) -> [U; 4] {
                let rows = from.as_chunks::<4>().0;
                let last = rows.len() - 1;
                transposed(words_of(at).map(|i| of_words(rows[last.min(i as usize)])))
            }

            // The parts of four rows.
            fn transposed(rows: [U; 4]) -> [U; 4] {
                let [a, b, c, d] = rows.map(|row| row.0);
                let (even, odd) = (a.interleave(c), b.interleave(d));
                let (first, second) = (even.0.interleave(odd.0), even.1.interleave(odd.1));
                [U(first.0), U(first.1), U(second.0), U(second.1)]
            }

            fn uscatter_rows(m: B, to: &mut [u32], at: U, v: [U; 4]) {
                let (at, rows) = (words_of(at), transposed(v).map(|row| words_of(row)));
                for lane in lane_numbers_in(lanes_of(m)) {
                    if let Some(row) = to.as_chunks_mut::<4>().0.get_mut(at[lane] as usize) {
                        *row = rows[lane];
                    }
                }
            }
        }
    };
}

/// What every processor of the architecture has.
pub mod baseline {
    #[cfg(not(any(target_feature = "sse2", target_arch = "aarch64")))]
    use fearless_simd::Fallback as Unit;
    #[cfg(target_arch = "aarch64")]
    use fearless_simd::Neon as Unit;
    #[cfg(target_feature = "sse2")]
    use fearless_simd::Sse2 as Unit;

    /// Name of the instructions.
    pub const NAME: &str = if cfg!(target_feature = "sse2") {
        "SSE2"
    } else if cfg!(target_arch = "aarch64") {
        "NEON"
    } else {
        "no vectors"
    };

    #[inline(always)]
    fn unit() -> Unit {
        #[allow(
            unused_unsafe,
            reason = "without vector instructions nothing is assumed"
        )]
        // SAFETY: the program is built for processors that have the instructions.
        unsafe {
            Unit::assume_supported()
        }
    }

    four_lanes!(false, #[cfg(all())]);
}

/// SSE4.2.
#[cfg(target_arch = "x86_64")]
pub mod sse4 {
    use fearless_simd::Sse4_2 as Unit;

    #[inline]
    #[target_feature(enable = "fxsr,sse4.2,cmpxchg16b,popcnt")]
    fn unit() -> Unit {
        Unit::assume_supported()
    }

    four_lanes!(true, #[target_feature(enable = "fxsr,sse4.2,cmpxchg16b,popcnt")]);
}
