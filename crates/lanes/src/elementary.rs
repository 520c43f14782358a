//! What both kinds of lanes make from their simple functions: logarithms, exponentials, bits, and the functions of WGSL
//! that are made of others.

/// Functions of lanes, each with the attribute at the head of the list.
macro_rules! lane_functions {
    (#[$attribute:meta] $(fn $name:ident($($argument:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block)+) => {
        $(#[inline] #[$attribute] pub fn $name($($argument: $type),*) $(-> $result)? $body)+
    };
}

/// The numbers of the lanes whose bits are set, from the lowest.
pub(crate) fn lane_numbers_in(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros();
        (bits != 0).then(|| {
            bits &= bits - 1;
            lane as usize
        })
    })
}

/// A float to which a small whole number is added in its lowest bits, with the exponent of 1 in them: 1.5 × 2²³ + 127.
pub(crate) const EXPONENT_IN_LOW_BITS: f32 = 12_583_039.0;

/// The functions that are made of others, with an attribute.
macro_rules! elementary {
    (#[$attribute:meta]) => {
        use $crate::elementary::EXPONENT_IN_LOW_BITS;

        $crate::elementary::lane_functions! {
            #[$attribute]

            fn lane_numbers() -> U {
                of_words(std::array::from_fn(|lane| lane as u32))
            }

            fn fword(x: u32) -> F {
                fs(f32::from_bits(x))
            }

            fn uword(x: u32) -> U {
                us(x)
            }

            fn bnot(a: B) -> B {
                bxor(a, bs(true))
            }

            fn beq(a: B, b: B) -> B {
                bnot(bxor(a, b))
            }

            fn bne(a: B, b: B) -> B {
                bxor(a, b)
            }

            fn une(a: U, b: U) -> B {
                bnot(ueq(a, b))
            }

            fn ffract(a: F) -> F {
                fsub(a, ffloor(a))
            }

            fn fclamp(a: F, low: F, high: F) -> F {
                fmin(fmax(a, low), high)
            }

            fn uclamp(a: U, low: U, high: U) -> U {
                umin(umax(a, low), high)
            }

            fn fmix(a: F, b: F, t: F) -> F {
                fused(t, fsub(b, a), a)
            }

            fn udiv(a: U, b: U) -> U {
                let (a, b) = (words_of(a), words_of(b));
                of_words(std::array::from_fn(|i| a[i].checked_div(b[i]).unwrap_or(a[i])))
            }

            fn urem(a: U, b: U) -> U {
                usub(a, umul(udiv(a, b), b))
            }

            fn ureverse(a: U) -> U {
                let swap = |a: U, shift: u32, mask: u32| {
                    let (up, down) = (ushl(uand(a, us(mask)), us(shift)), ushr(a, us(shift)));
                    uor(up, uand(down, us(mask)))
                };
                let a = swap(swap(swap(a, 1, 0x5555_5555), 2, 0x3333_3333), 4, 0x0f0f_0f0f);
                let a = swap(a, 8, 0x00ff_00ff);
                uor(ushl(a, us(16)), ushr(a, us(16)))
            }

            fn utrailing(a: U) -> U {
                // The lowest bit alone is a power of two, or of its opposite, whose exponent a float tells.
                let lowest = uand(a, usub(us(0), a));
                let exponent = uand(ushr(fbitsu(i2f(u2i(lowest))), us(23)), us(0xff));
                usel(ueq(a, us(0)), us(u32::MAX), usub(exponent, us(127)))
            }

            fn usum(m: B, a: U) -> u32 {
                words_of(usel(m, a, us(0))).iter().fold(0, |sum, &x| sum.wrapping_add(x))
            }

            fn fgather(from: &[u32], at: U) -> F {
                ubitsf(ugather(from, at))
            }

            fn fgather_rows(from: &[u32], at: U) -> [F; 4] {
                let [a, b, c, d] = ugather_rows(from, at);
                [ubitsf(a), ubitsf(b), ubitsf(c), ubitsf(d)]
            }

            fn uscatter(m: B, to: &mut [u32], at: U, v: U) {
                let (at, v) = (words_of(at), words_of(v));
                for lane in lane_numbers_in(lanes_of(m)) {
                    if let Some(word) = to.get_mut(at[lane] as usize) {
                        *word = v[lane];
                    }
                }
            }

            fn fscatter(m: B, to: &mut [u32], at: U, v: F) {
                uscatter(m, to, at, fbitsu(v));
            }

            fn fscatter_rows(m: B, to: &mut [u32], at: U, v: [F; 4]) {
                let [a, b, c, d] = v;
                uscatter_rows(m, to, at, [fbitsu(a), fbitsu(b), fbitsu(c), fbitsu(d)]);
            }

            fn polynomial(x: F, highest: f32, others: &[f32]) -> F {
                others.iter().fold(fs(highest), |sum, &c| fused(sum, x, fs(c)))
            }

            // e^x as 2^n e^r with |r| <= ln 2 / 2; the polynomial and the two parts of ln 2 are those of Cephes' expf
            // (Moshier), within 2 units in the last place from −87 to 88.3. Below it is 0, although floats go on to
            // e^−104: some processors take a hundred cycles for each result that is not a normal number.
            fn fexp(a: F) -> F {
                let x = fclamp(a, fs(-87.0), fs(88.722_84));
                // With a large number added n is in the lowest bits, and n + 127, the exponent of 2^n, all that a shift leaves.
                let shifted = fadd(fmul(x, fs(std::f32::consts::LOG2_E)), fs(EXPONENT_IN_LOW_BITS));
                let n = fsub(shifted, fs(EXPONENT_IN_LOW_BITS));
                let r = fused(n, fs(-355.0 / 512.0), x);
                let r = fused(n, fs(2.121_944_4e-4), r);
                let p = polynomial(
                    r,
                    1.987_569_1e-4,
                    &[1.398_199_9e-3, 8.333_452e-3, 4.166_579_5e-2, 0.166_666_65, 0.5],
                );
                let y = fadd(fused(p, fmul(r, r), r), fs(1.0));
                let power = ubitsf(ushl(fbitsu(shifted), us(23)));
                fsel(flt(a, fs(-87.0)), fs(0.0), fmul(y, power))
            }

            // ln x as ln m + e ln 2 with m from √½ to √2, by Cephes' logf (Moshier); −∞ at 0.
            fn flog(a: F) -> F {
                let is_tiny = flt(a, fs(f32::MIN_POSITIVE));
                let x = fsel(is_tiny, fmul(a, fs(8_388_608.0)), a);
                let bits = u2i(fbitsu(x));
                let e = ishr(isub(bits, is(0x3f35_04f3)), us(23));
                let m = ubitsf(i2u(isub(bits, ishl(e, us(23)))));
                let e = fsub(i2f(e), fsel(is_tiny, fs(23.0), fs(0.0)));
                let r = fsub(m, fs(1.0));
                let square = fmul(r, r);
                let p = polynomial(
                    r,
                    7.037_683_6e-2,
                    &[
                        -0.115_146_1, 0.116_769_99, -0.124_201_41, 0.142_493_23,
                        -0.166_680_57, 0.200_007_14, -0.249_999_94, 0.333_333_3,
                    ],
                );
                let y = fmul(fmul(p, r), square);
                let y = fused(e, fs(-2.121_944_4e-4), y);
                let y = fused(square, fs(-0.5), y);
                let ln = fused(e, fs(355.0 / 512.0), fadd(r, y));
                fsel(fle(a, fs(0.0)), fs(f32::NEG_INFINITY), ln)
            }
        }
    };
}

/// What is stored is what was chosen, with an attribute.
macro_rules! keep_as_chosen {
    (#[$attribute:meta]) => {
        $crate::elementary::lane_functions! {
            #[$attribute]

            fn fkeep(m: B, a: F, b: F) -> F {
                fsel(m, a, b)
            }

            fn ukeep(m: B, a: U, b: U) -> U {
                usel(m, a, b)
            }

            fn bkeep(m: B, a: B, b: B) -> B {
                bsel(m, a, b)
            }
        }
    };
}

pub(crate) use {elementary, keep_as_chosen, lane_functions};
