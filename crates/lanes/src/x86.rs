//! Eight floats or whole numbers in vectors of 256 bits, for processors with AVX2 and fused multiplication: what does not
//! depend on how conditions are kept. Names are as in [`crate::four`], which says what each is.

use std::arch::x86_64::*;

use crate::elementary::{lane_functions, lane_numbers_in};

/// Lanes of a group.
pub const LANES: usize = 8;

/// Floats, a whole number with and one without sign of every lane.
#[derive(Clone, Copy)]
pub struct F(pub(crate) __m256);
#[derive(Clone, Copy)]
pub struct I(pub(crate) __m256i);
#[derive(Clone, Copy)]
pub struct U(pub(crate) __m256i);

lane_functions! {
    #[target_feature(enable = "avx2,fma")]

    fn fs(x: f32) -> F {
        F(_mm256_set1_ps(x))
    }

    fn us(x: u32) -> U {
        U(_mm256_set1_epi32(x.cast_signed()))
    }

    fn is(x: i32) -> I {
        I(_mm256_set1_epi32(x))
    }

    fn fadd(a: F, b: F) -> F {
        F(_mm256_add_ps(a.0, b.0))
    }

    fn fsub(a: F, b: F) -> F {
        F(_mm256_sub_ps(a.0, b.0))
    }

    fn fmul(a: F, b: F) -> F {
        F(_mm256_mul_ps(a.0, b.0))
    }

    fn fdiv(a: F, b: F) -> F {
        F(_mm256_div_ps(a.0, b.0))
    }

    fn fmin(a: F, b: F) -> F {
        F(_mm256_min_ps(a.0, b.0))
    }

    fn fmax(a: F, b: F) -> F {
        F(_mm256_max_ps(a.0, b.0))
    }

    fn fused(a: F, b: F, c: F) -> F {
        F(_mm256_fmadd_ps(a.0, b.0, c.0))
    }

    fn fsqrt(a: F) -> F {
        F(_mm256_sqrt_ps(a.0))
    }

    fn ffloor(a: F) -> F {
        F(_mm256_floor_ps(a.0))
    }

    fn fround(a: F) -> F {
        F(_mm256_round_ps::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(a.0))
    }

    fn fabs(a: F) -> F {
        F(_mm256_andnot_ps(_mm256_set1_ps(-0.0), a.0))
    }

    fn fneg(a: F) -> F {
        F(_mm256_xor_ps(_mm256_set1_ps(-0.0), a.0))
    }

    fn uadd(a: U, b: U) -> U {
        U(_mm256_add_epi32(a.0, b.0))
    }

    fn usub(a: U, b: U) -> U {
        U(_mm256_sub_epi32(a.0, b.0))
    }

    fn umul(a: U, b: U) -> U {
        U(_mm256_mullo_epi32(a.0, b.0))
    }

    fn uand(a: U, b: U) -> U {
        U(_mm256_and_si256(a.0, b.0))
    }

    fn uor(a: U, b: U) -> U {
        U(_mm256_or_si256(a.0, b.0))
    }

    fn uxor(a: U, b: U) -> U {
        U(_mm256_xor_si256(a.0, b.0))
    }

    fn umin(a: U, b: U) -> U {
        U(_mm256_min_epu32(a.0, b.0))
    }

    fn umax(a: U, b: U) -> U {
        U(_mm256_max_epu32(a.0, b.0))
    }

    fn ushl(a: U, b: U) -> U {
        U(_mm256_sllv_epi32(a.0, b.0))
    }

    fn unot(a: U) -> U {
        U(_mm256_xor_si256(a.0, _mm256_set1_epi32(-1)))
    }

    fn isub(a: I, b: I) -> I {
        I(_mm256_sub_epi32(a.0, b.0))
    }

    fn iand(a: I, b: I) -> I {
        I(_mm256_and_si256(a.0, b.0))
    }

    fn ishl(a: I, b: U) -> I {
        I(_mm256_sllv_epi32(a.0, b.0))
    }

    fn ushr(a: U, b: U) -> U {
        U(_mm256_srlv_epi32(a.0, b.0))
    }

    fn ishr(a: I, b: U) -> I {
        I(_mm256_srav_epi32(a.0, b.0))
    }

    fn i2u(a: I) -> U {
        U(a.0)
    }

    fn u2i(a: U) -> I {
        I(a.0)
    }

    fn fbitsu(a: F) -> U {
        U(_mm256_castps_si256(a.0))
    }

    fn ubitsf(a: U) -> F {
        F(_mm256_castsi256_ps(a.0))
    }

    fn i2f(a: I) -> F {
        F(_mm256_cvtepi32_ps(a.0))
    }

    fn f2i(a: F) -> I {
        I(_mm256_cvttps_epi32(a.0))
    }

    fn u2f(a: U) -> F {
        // Halves of 16 bits are exact; their sum is rounded once.
        let high = _mm256_cvtepi32_ps(_mm256_srli_epi32::<16>(a.0));
        let low = _mm256_cvtepi32_ps(_mm256_and_si256(a.0, _mm256_set1_epi32(0xffff)));
        F(_mm256_fmadd_ps(high, _mm256_set1_ps(65536.0), low))
    }

    fn f2u(a: F) -> U {
        // From 2³¹ on by way of what is left when that is taken off; from 2³² on the largest number.
        let half = _mm256_set1_ps(2_147_483_648.0);
        let positive = _mm256_max_ps(a.0, _mm256_setzero_ps());
        let large = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_GE_OQ>(positive, half));
        let rest_of_range = _mm256_sub_ps(positive, half);
        let rest = _mm256_cvttps_epi32(rest_of_range);
        let upper = _mm256_xor_si256(rest, _mm256_set1_epi32(i32::MIN));
        let whole = _mm256_blendv_epi8(_mm256_cvttps_epi32(positive), upper, large);
        let beyond = _mm256_cmp_ps::<_CMP_GE_OQ>(rest_of_range, half);
        U(_mm256_or_si256(whole, _mm256_castps_si256(beyond)))
    }

    fn words_of(a: U) -> [u32; LANES] {
        // SAFETY: both are 256 bits, and every pattern is a number.
        unsafe { std::mem::transmute(a.0) }
    }

    fn of_words(a: [u32; LANES]) -> U {
        // SAFETY: both are 256 bits, and every pattern is a number.
        U(unsafe { std::mem::transmute::<[u32; LANES], __m256i>(a) })
    }

    fn ugather(from: &[u32], at: U) -> U {
        let last = us((from.len().min(i32::MAX as usize) - 1) as u32);
        let at = umin(at, last);
        // SAFETY: no index is beyond the last word, of which memory holds at least one, or 2³¹.
        U(unsafe { _mm256_i32gather_epi32::<4>(from.as_ptr().cast(), at.0) })
    }

    fn ugather_rows(from: &[u32], at: U) -> [U; 4] {
        let last = us(from.len() as u32 / 4 - 1);
        let at = words_of(umin(at, last));
        // SAFETY: no index is beyond the last row of four words; memory holds at least one.
        let row = |k: usize| unsafe { _mm_loadu_ps(from.as_ptr().add(4 * at[k] as usize).cast()) };
        let pair = |k| _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(row(k)), row(k + 4));
        transposed([pair(0), pair(1), pair(2), pair(3)]).map(|v| U(_mm256_castps_si256(v)))
    }

    fn transposed(r: [__m256; 4]) -> [__m256; 4] {
        let (a, b) = (_mm256_unpacklo_ps(r[0], r[1]), _mm256_unpackhi_ps(r[0], r[1]));
        let (c, d) = (_mm256_unpacklo_ps(r[2], r[3]), _mm256_unpackhi_ps(r[2], r[3]));
        [
            _mm256_shuffle_ps::<0x44>(a, c),
            _mm256_shuffle_ps::<0xee>(a, c),
            _mm256_shuffle_ps::<0x44>(b, d),
            _mm256_shuffle_ps::<0xee>(b, d),
        ]
    }

    fn store_rows(lanes: u32, to: &mut [u32], at: U, v: [U; 4]) {
        let rows = transposed(v.map(|x| _mm256_castsi256_ps(x.0)));
        let rows = rows.map(|r| words_of(U(_mm256_castps_si256(r))));
        let at = words_of(at);
        for lane in lane_numbers_in(lanes) {
            let first = 4 * at[lane] as usize;
            if let Some(row) = to.get_mut(first..first + 4) {
                row.copy_from_slice(&rows[lane % 4][lane / 4 * 4..][..4]);
            }
        }
    }
}
