//! Eight lanes for processors with AVX2 and fused multiplication. Names are as in [`crate::four`], which says what
//! each is.

use std::arch::{asm, x86_64::*};

use crate::elementary::{lane_functions, lane_numbers_in};
use crate::tree::*;
pub use crate::x86::*;

/// A condition of every lane: all bits of its word or none.
#[derive(Clone, Copy)]
pub struct B(__m256i);

crate::elementary::elementary!(#[target_feature(enable = "avx2,fma")]);
crate::tree::tree_functions!(#[target_feature(enable = "avx2,fma")]);

lane_functions! {
    #[target_feature(enable = "avx2,fma")]

    fn bs(x: bool) -> B {
        B(_mm256_set1_epi32(-i32::from(x)))
    }

    fn feq(a: F, b: F) -> B {
        B(_mm256_castps_si256(_mm256_cmp_ps::<_CMP_EQ_OQ>(a.0, b.0)))
    }

    fn fne(a: F, b: F) -> B {
        B(_mm256_castps_si256(_mm256_cmp_ps::<_CMP_NEQ_UQ>(a.0, b.0)))
    }

    fn flt(a: F, b: F) -> B {
        B(_mm256_castps_si256(_mm256_cmp_ps::<_CMP_LT_OQ>(a.0, b.0)))
    }

    fn fle(a: F, b: F) -> B {
        B(_mm256_castps_si256(_mm256_cmp_ps::<_CMP_LE_OQ>(a.0, b.0)))
    }

    fn fsel(m: B, a: F, b: F) -> F {
        F(_mm256_blendv_ps(b.0, a.0, _mm256_castsi256_ps(m.0)))
    }

    fn ueq(a: U, b: U) -> B {
        B(_mm256_cmpeq_epi32(a.0, b.0))
    }

    fn ule(a: U, b: U) -> B {
        ueq(umin(a, b), a)
    }

    fn ult(a: U, b: U) -> B {
        bnot(ule(b, a))
    }

    fn usel(m: B, a: U, b: U) -> U {
        U(_mm256_blendv_epi8(b.0, a.0, m.0))
    }

    fn ieq(a: I, b: I) -> B {
        B(_mm256_cmpeq_epi32(a.0, b.0))
    }

    fn bsel(m: B, a: B, b: B) -> B {
        B(_mm256_blendv_epi8(b.0, a.0, m.0))
    }

    fn band(a: B, b: B) -> B {
        B(_mm256_and_si256(a.0, b.0))
    }

    fn bor(a: B, b: B) -> B {
        B(_mm256_or_si256(a.0, b.0))
    }

    fn bxor(a: B, b: B) -> B {
        B(_mm256_xor_si256(a.0, b.0))
    }

    fn bandnot(a: B, b: B) -> B {
        B(_mm256_andnot_si256(a.0, b.0))
    }

    fn any(a: B) -> bool {
        _mm256_testz_si256(a.0, a.0) == 0
    }

    fn fkeep(m: B, a: F, b: F) -> F {
        F(at_once(fsel(m, a, b).0))
    }

    fn ukeep(m: B, a: U, b: U) -> U {
        U(_mm256_castps_si256(at_once(_mm256_castsi256_ps(usel(m, a, b).0))))
    }

    fn bkeep(m: B, a: B, b: B) -> B {
        B(ukeep(m, U(a.0), U(b.0)).0)
    }

    // What is chosen with a mask and then stored would become a store with a mask, which is slow on some processors and
    // cannot be read again at once.
    fn at_once(x: __m256) -> __m256 {
        let mut chosen = x;
        // SAFETY: no instruction at all.
        unsafe {
            asm!("/* {0} */", inlateout(ymm_reg) chosen, options(pure, nomem, nostack, preserves_flags));
        }
        chosen
    }

    fn lanes_of(m: B) -> u32 {
        _mm256_movemask_ps(_mm256_castsi256_ps(m.0)).cast_unsigned()
    }

    fn uscatter_rows(m: B, to: &mut [u32], at: U, v: [U; 4]) {
        store_rows(lanes_of(m), to, at, v);
    }
}
