//! Eight lanes for processors with the vectors of AVX-512 in 256 bits: conditions are bits in registers of their own, and there
//! are twice as many vector registers. Names are as in [`crate::four`], which says what each is.

use std::arch::x86_64::*;

use crate::elementary::{lane_functions, lane_numbers_in};
use crate::tree::*;
pub use crate::x86::*;

/// A condition of every lane, a bit each.
#[derive(Clone, Copy)]
pub struct B(__mmask8);

crate::elementary::elementary!(#[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq,avx512bw")]);
crate::tree::tree_functions!(#[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq,avx512bw")]);
// Guarding against stores with a mask, as on AVX2, gained nothing here.
crate::elementary::keep_as_chosen!(#[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq,avx512bw")]);

lane_functions! {
    #[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq,avx512bw")]

    fn bs(x: bool) -> B {
        B(if x { 0xff } else { 0 })
    }

    fn feq(a: F, b: F) -> B {
        B(_mm256_cmp_ps_mask::<_CMP_EQ_OQ>(a.0, b.0))
    }

    fn fne(a: F, b: F) -> B {
        B(_mm256_cmp_ps_mask::<_CMP_NEQ_UQ>(a.0, b.0))
    }

    fn flt(a: F, b: F) -> B {
        B(_mm256_cmp_ps_mask::<_CMP_LT_OQ>(a.0, b.0))
    }

    fn fle(a: F, b: F) -> B {
        B(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(a.0, b.0))
    }

    fn fsel(m: B, a: F, b: F) -> F {
        F(_mm256_mask_blend_ps(m.0, b.0, a.0))
    }

    fn ueq(a: U, b: U) -> B {
        B(_mm256_cmpeq_epi32_mask(a.0, b.0))
    }

    fn ule(a: U, b: U) -> B {
        ueq(umin(a, b), a)
    }

    fn ult(a: U, b: U) -> B {
        bnot(ule(b, a))
    }

    fn usel(m: B, a: U, b: U) -> U {
        U(_mm256_mask_blend_epi32(m.0, b.0, a.0))
    }

    fn ieq(a: I, b: I) -> B {
        B(_mm256_cmpeq_epi32_mask(a.0, b.0))
    }

    fn bsel(m: B, a: B, b: B) -> B {
        B((m.0 & a.0) | (!m.0 & b.0))
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
        a.0 != 0
    }

    fn lanes_of(m: B) -> u32 {
        u32::from(m.0)
    }

    fn uscatter_rows(m: B, to: &mut [u32], at: U, v: [U; 4]) {
        store_rows(lanes_of(m), to, at, v);
    }
}
