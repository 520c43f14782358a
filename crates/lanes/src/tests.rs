//! Functions of lanes against those of the standard library, with all kinds of instructions.

/// Numbers from 0 to 1, evenly spread and the same every time.
fn numbers(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(|i| (i as f64 * 0.618_033_988_749_894_9).fract())
}

/// Words of all sizes.
fn words<const LANES: usize>() -> Vec<[u32; LANES]> {
    let word = |u: f64| ((u * 4_294_967_296.0) as u32) >> ((u * 1e6) as u32 % 32);
    let mut all: Vec<u32> = numbers(16_000).map(word).collect();
    all.extend([
        0,
        1,
        2,
        0x7fff_ffff,
        0x8000_0000,
        0x8000_0001,
        0xffff_fffe,
        u32::MAX,
    ]);
    all.as_chunks().0.to_vec()
}

macro_rules! checks {
    ($name:ident, $($lanes:ident)::+, $(#[$attribute:meta])*) => {
        mod $name {
            use crate::$($lanes)::+::*;

            $(#[$attribute])*
            pub(super) fn elementary() {
                let floats = |a: F| words_of(fbitsu(a)).map(f32::from_bits);
                let of = |a: [f32; LANES]| ubitsf(of_words(a.map(f32::to_bits)));
                let all: Vec<f32> = super::numbers(80_000).map(|u| u as f32).collect();
                for group in all.as_chunks::<LANES>().0 {
                    let x = group.map(|u| 190.0 * u - 102.0);
                    for (got, x) in floats(fexp(of(x))).into_iter().zip(x) {
                        // Below -87 a normal number soon cannot hold it.
                        let want = if x < -87.0 { 0.0 } else { f64::from(x).exp() };
                        assert!((f64::from(got) - want).abs() <= 4e-7 * want, "exp {x}: {got}, not {want}");
                    }
                    let x = group.map(|u| (170.0 * f64::from(u) - 85.0).exp() as f32);
                    for (got, x) in floats(flog(of(x))).into_iter().zip(x) {
                        let want = f64::from(x).ln();
                        let allowed = 2e-7 * want.abs().max(0.01);
                        assert!((f64::from(got) - want).abs() <= allowed, "ln {x}: {got}, not {want}");
                    }
                    let x = group.map(|u| 20.0 * u - 10.0);
                    for (got, x) in floats(ffract(of(x))).into_iter().zip(x) {
                        assert_eq!(got, x - x.floor(), "fraction of {x}");
                    }
                    for (got, x) in floats(fround(of(x))).into_iter().zip(x) {
                        assert_eq!(got, x.round_ties_even(), "{x} rounded");
                    }
                }
                assert_eq!(floats(flog(fs(0.0))), [f32::NEG_INFINITY; LANES]);
                assert_eq!(floats(flog(fs(1.0))), [0.0; LANES]);
                assert_eq!(floats(fexp(fs(-1e30))), [0.0; LANES]);
                assert_eq!(floats(fexp(fs(0.0))), [1.0; LANES]);
            }

            $(#[$attribute])*
            pub(super) fn whole_numbers() {
                let ones = |m: B| usel(m, us(1), us(0));
                for x in super::words::<LANES>() {
                    let a = of_words(x);
                    assert_eq!(words_of(ureverse(a)), x.map(u32::reverse_bits));
                    let trailing = |w: u32| if w == 0 { u32::MAX } else { w.trailing_zeros() };
                    assert_eq!(words_of(utrailing(a)), x.map(trailing), "{x:x?}");
                    assert_eq!(words_of(fbitsu(u2f(a))), x.map(|w| (w as f32).to_bits()), "{x:x?}");
                    let whole = x.map(|w| w as f32);
                    let back = f2u(ubitsf(of_words(whole.map(f32::to_bits))));
                    assert_eq!(words_of(back), whole.map(|f| f as u32), "{whole:?}");
                    let mut y = x;
                    y.rotate_left(3);
                    let b = of_words(y);
                    let pairs = |f: fn(u32, u32) -> u32| std::array::from_fn::<u32, LANES, _>(|i| f(x[i], y[i]));
                    assert_eq!(words_of(udiv(a, b)), pairs(|a, b| a.checked_div(b).unwrap_or(a)));
                    assert_eq!(words_of(ones(ult(a, b))), pairs(|a, b| u32::from(a < b)));
                    assert_eq!(words_of(ones(ule(a, b))), pairs(|a, b| u32::from(a <= b)));
                    let shift = uand(b, us(31));
                    assert_eq!(words_of(ushr(a, shift)), pairs(|a, b| a >> (b & 31)));
                    assert_eq!(words_of(ushl(a, shift)), pairs(|a, b| a << (b & 31)));
                    assert_eq!(usum(bs(true), a), x.iter().fold(0, |s: u32, w| s.wrapping_add(*w)));
                }
            }

            /// Indices beyond the end read the last word or row and write nothing.
            $(#[$attribute])*
            pub(super) fn memory() {
                let mut table: Vec<u32> = (100..124).collect();
                let odd = ueq(uand(lane_numbers(), us(1)), us(1));
                let at = [0, 5, 3, 23, 24, 7, u32::MAX, 1];
                for at in at.as_chunks::<LANES>().0 {
                    let clamped = at.map(|i: u32| 100 + i.min(23));
                    assert_eq!(words_of(ugather(&table, of_words(*at))), clamped);
                    let rows = ugather_rows(&table, of_words(*at));
                    for (part, words) in (0..).zip(rows.map(|r| words_of(r))) {
                        assert_eq!(words, at.map(|i: u32| 100 + 4 * i.min(5) + part));
                    }
                }
                for at in at.as_chunks::<LANES>().0 {
                    uscatter(odd, &mut table, of_words(*at), us(1));
                }
                let changed: Vec<usize> = (0..24).filter(|&i| table[i] == 1).collect();
                assert_eq!(changed, [1, 5, 7, 23]);
                let mut table = vec![0; 24];
                let value = [2, 3, 4, 5].map(|x| uadd(us(10 * x), lane_numbers()));
                for at in [9, 4, 9, 9, 9, 0, 9, u32::MAX].as_chunks::<LANES>().0 {
                    uscatter_rows(odd, &mut table, of_words(*at), value);
                }
                let mut expected = vec![0; 24];
                expected[16..20].copy_from_slice(&[21, 31, 41, 51]);
                let lane = 5 % LANES as u32;
                expected[..4].copy_from_slice(&[20, 30, 40, 50].map(|x| x + lane));
                assert_eq!(table, expected);
            }
        }
    };
}

checks!(baseline, four::baseline,);
#[cfg(target_arch = "x86_64")]
checks!(sse4, four::sse4, #[target_feature(enable = "fxsr,sse4.2,cmpxchg16b,popcnt")]);
#[cfg(target_arch = "x86_64")]
checks!(avx2, avx2, #[target_feature(enable = "avx2,fma")]);
#[cfg(target_arch = "x86_64")]
checks!(avx512, avx512, #[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq,avx512bw")]);

#[test]
fn lanes_of_the_baseline() {
    baseline::elementary();
    baseline::whole_numbers();
    baseline::memory();
}

#[cfg(target_arch = "x86_64")]
#[test]
fn lanes_of_sse4() {
    if !crate::Instructions::Sse4.are_here() {
        eprintln!("skipped: the processor lacks SSE4.2");
        return;
    }
    // SAFETY: the processor has the instructions.
    unsafe {
        sse4::elementary();
        sse4::whole_numbers();
        sse4::memory();
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn lanes_of_avx2() {
    if !crate::Instructions::Avx2.are_here() {
        eprintln!("skipped: the processor lacks AVX2");
        return;
    }
    // SAFETY: the processor has the instructions.
    unsafe {
        avx2::elementary();
        avx2::whole_numbers();
        avx2::memory();
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn lanes_of_avx512() {
    if !crate::Instructions::Avx512.are_here() {
        eprintln!("skipped: the processor lacks AVX-512");
        return;
    }
    // SAFETY: the processor has the instructions.
    unsafe {
        avx512::elementary();
        avx512::whole_numbers();
        avx512::memory();
    }
}
