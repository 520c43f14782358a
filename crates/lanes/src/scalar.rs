//! One lane in double precision: what the functions of the shading language do in it, and its memory.
//!
//! Names as in [`crate::portable`]. A whole number without sign is as wide as a word of memory, so that it can carry the bits
//! of a number between them; what is computed with it stays below 2³².

mod memory;

use std::f64::consts::FRAC_PI_2;

use memory::{Memory, Word};
pub use memory::{Point, Surfaces, Tables};

use crate::{COUNTERS, DISPATCH_WORDS, Kernel};

type F = f64;
type U = u64;
type B = bool;

macro_rules! functions {
    ($(fn $name:ident($($argument:ident: $type:ty),*) -> $result:ty $body:block)+) => {
        $(#[inline] fn $name($($argument: $type),*) -> $result $body)+
    };
}

functions! {
    fn fs(x: f64) -> F { x }
    fn us(x: u32) -> U { U::from(x) }
    fn bs(x: bool) -> B { x }
    fn fadd(a: F, b: F) -> F { a + b }
    fn fsub(a: F, b: F) -> F { a - b }
    fn fmul(a: F, b: F) -> F { a * b }
    fn fdiv(a: F, b: F) -> F { a / b }
    fn fmin(a: F, b: F) -> F { if a < b { a } else { b } }
    fn fmax(a: F, b: F) -> F { if a > b { a } else { b } }
    fn fclamp(a: F, low: F, high: F) -> F { fmin(fmax(a, low), high) }
    fn fmix(a: F, b: F, t: F) -> F { a + t * (b - a) }
    fn fsqrt(a: F) -> F { a.sqrt() }
    fn ffloor(a: F) -> F { a.floor() }
    fn ffract(a: F) -> F { a - a.floor() }
    fn fround(a: F) -> F { a.round_ties_even() }
    fn fabs(a: F) -> F { a.abs() }
    fn fneg(a: F) -> F { -a }
    fn fexp(a: F) -> F { a.exp() }
    fn flog(a: F) -> F { a.ln() }
    fn feq(a: F, b: F) -> B { a == b }
    fn fne(a: F, b: F) -> B { a != b }
    fn flt(a: F, b: F) -> B { a < b }
    fn fle(a: F, b: F) -> B { a <= b }
    fn fsel(m: B, a: F, b: F) -> F { if m { a } else { b } }
    fn uadd(a: U, b: U) -> U { us((a as u32).wrapping_add(b as u32)) }
    fn usub(a: U, b: U) -> U { us((a as u32).wrapping_sub(b as u32)) }
    fn umul(a: U, b: U) -> U { us((a as u32).wrapping_mul(b as u32)) }
    fn udiv(a: U, b: U) -> U { a.checked_div(b).unwrap_or(a) }
    fn urem(a: U, b: U) -> U { a.checked_rem(b).unwrap_or(0) }
    fn uand(a: U, b: U) -> U { a & b }
    fn uor(a: U, b: U) -> U { a | b }
    fn uxor(a: U, b: U) -> U { a ^ b }
    fn unot(a: U) -> U { us(!(a as u32)) }
    fn ushl(a: U, b: U) -> U { us((a as u32).checked_shl(b as u32).unwrap_or(0)) }
    fn ushr(a: U, b: U) -> U { us((a as u32).checked_shr(b as u32).unwrap_or(0)) }
    fn umin(a: U, b: U) -> U { a.min(b) }
    fn umax(a: U, b: U) -> U { a.max(b) }
    fn ueq(a: U, b: U) -> B { a == b }
    fn une(a: U, b: U) -> B { a != b }
    fn ult(a: U, b: U) -> B { a < b }
    fn ule(a: U, b: U) -> B { a <= b }
    fn usel(m: B, a: U, b: U) -> U { if m { a } else { b } }
    fn ureverse(a: U) -> U { us((a as u32).reverse_bits()) }
    fn utrailing(a: U) -> U { us(if a == 0 { u32::MAX } else { a.trailing_zeros() }) }
    fn beq(a: B, b: B) -> B { a == b }
    fn bne(a: B, b: B) -> B { a != b }
    fn bnot(a: B) -> B { !a }
    fn band(a: B, b: B) -> B { a & b }
    fn bor(a: B, b: B) -> B { a | b }
    fn u2f(a: U) -> F { F::from(a as u32) }
    fn f2u(a: F) -> U { us(a as u32) }
    fn fword(x: u64) -> F { ubitsf(x) }
    fn uword(x: u64) -> U { x }
}

/// The number whose bits a word is, of an `f64` or, below 2³², of an `f32`.
#[inline]
fn ubitsf(word: U) -> F {
    if word >> 32 == 0 {
        F::from(f32::from_bits(word as u32))
    } else {
        F::from_bits(word)
    }
}

/// An index that is within a row of `count` elements.
#[inline]
fn within(index: U, count: usize) -> usize {
    (index as usize).min(count - 1)
}

#[inline]
fn ugather<W: Word>(from: &[W], at: U) -> U {
    from[within(at, from.len())].wide()
}

#[inline]
fn fgather<W: Word>(from: &[W], at: U) -> F {
    ubitsf(ugather(from, at))
}

#[inline]
fn ugather_rows<W: Word>(from: &[W], at: U) -> [U; 4] {
    let first = 4 * within(at, from.len() / 4);
    std::array::from_fn(|i| from[first + i].wide())
}

#[inline]
fn fgather_rows<W: Word>(from: &[W], at: U) -> [F; 4] {
    ugather_rows(from, at).map(ubitsf)
}

#[inline]
fn uscatter(to: &mut [u64], at: U, v: U) {
    if let Some(word) = to.get_mut(at as usize) {
        *word = v;
    }
}

#[inline]
fn fscatter(to: &mut [u64], at: U, v: F) {
    uscatter(to, at, word_of(v));
}

#[inline]
fn fscatter_rows(to: &mut [u64], at: U, v: [F; 4]) {
    let first = 4 * at as usize;
    if let Some(row) = to.get_mut(first..first + 4) {
        row.copy_from_slice(&v.map(word_of));
    }
}

/// The word of a number; what is no normal number is 0.
#[inline]
pub fn word_of(x: F) -> u64 {
    let bits = x.to_bits();
    if bits >> 32 == 0 { 0 } else { bits }
}

/// Cosine and sine of an angle in quarters of a turn, which are exact where the turn is.
#[inline]
fn cosine_and_sine_of_quarters(quarters: F) -> [F; 2] {
    let whole = quarters.round_ties_even();
    let (sine, cosine) = ((quarters - whole) * FRAC_PI_2).sin_cos();
    match whole as i64 & 3 {
        0 => [cosine, sine],
        1 => [-sine, cosine],
        2 => [-cosine, -sine],
        _ => [sine, -cosine],
    }
}

/// Bits of the mantissa of an `f64` that remain inside a block of a piecewise function.
const INNER_BITS: u32 = 49;
const INNER_MASK: u64 = (1 << INNER_BITS) - 1;
/// The `f64` below 1/2, as bits.
const LARGEST_KEY: u64 = 0x3fdf_ffff_ffff_ffff;

/// A piecewise function at a key. Twin: `table_at` of `shaders/common/phase.wgsl`, in the bits of an `f64`; `ends` holds the
/// bits of `f32`.
#[inline]
fn piecewise_cubic(rows: &[u64], (ends, blocks, cells): ([U; 4], U, U), key: F, high: bool) -> F {
    let (smallest, first) = if high {
        (ends[2], ends[3])
    } else {
        (ends[0], ends[1])
    };
    let smallest = ubitsf(smallest).to_bits();
    // Negative keys sort below all others as numbers with a sign.
    let bits = (key.to_bits() as i64).clamp(smallest as i64, LARGEST_KEY as i64) as u64;
    let block = blocks + first + (bits >> INNER_BITS) - (smallest >> INNER_BITS);
    let block = ugather(rows, block);
    let split = (block & 15) as u32;
    let inner = bits & INNER_MASK;
    let cell = fgather_rows(rows, cells + (block >> 4) + (inner >> (INNER_BITS - split)));
    let inside = (inner << split) & INNER_MASK;
    let t = f64::from_bits(1f64.to_bits() | inside << 3) - 1.0;
    (cell[0] + t * cell[1]) + t * t * (cell[2] + t * cell[3])
}

/// A kernel as Rust, made by `build/`.
macro_rules! generated {
    ($name:ident, $file:literal) => {
        #[allow(
            clippy::all,
            nonstandard_style,
            unused,
            missing_docs,
            reason = "made by a program"
        )]
        mod $name {
            use super::*;
            include!(concat!(env!("OUT_DIR"), "/", $file, ".rs"));
        }
    };
}

generated!(lamps, "lamps_scalar");
generated!(ambient, "ambient_scalar");

/// A kernel and its memory.
enum State<'a> {
    Lamps(Box<lamps::State<'a>>),
    Ambient(Box<ambient::State<'a>>),
}

/// One lane that runs one kernel in double precision.
pub struct Lane<'a> {
    state: State<'a>,
    layers: u32,
}

impl<'a> Lane<'a> {
    /// A lane for the scene of `tables`; the other arguments are those of [`crate::Group::new`].
    pub fn new(
        kernel: Kernel,
        tables: &Tables<'a>,
        sizes @ (_, film_layers, _): (u32, u32, u32),
        is_on: &dyn Fn(&str) -> bool,
    ) -> Self {
        let memory = Memory::new(tables, sizes);
        let state = match kernel {
            Kernel::Lamps => State::Lamps(Box::new(lamps::new(memory, is_on))),
            Kernel::Ambient => State::Ambient(Box::new(ambient::new(memory, is_on))),
        };
        Self {
            state,
            layers: film_layers,
        }
    }

    fn memory(&mut self) -> &mut Memory<'a> {
        match &mut self.state {
            State::Lamps(state) => &mut state.memory,
            State::Ambient(state) => &mut state.memory,
        }
    }

    /// As [`crate::Group::set_rays`].
    pub fn set_rays(&mut self, rows: &[f64]) {
        let rays = &mut self.memory().rays;
        rays.clear();
        rays.extend(rows.iter().map(|&x| word_of(x)));
    }

    /// As [`crate::Group::run`].
    pub fn run(
        &mut self,
        first_pixel: u32,
        dispatch: [u32; DISPATCH_WORDS],
    ) -> (impl Iterator<Item = f64>, [u32; COUNTERS]) {
        let layers = self.layers;
        self.memory().start(first_pixel, layers, dispatch);
        match &mut self.state {
            State::Lamps(state) => lamps::run(state),
            State::Ambient(state) => ambient::run(state),
        }
        let memory = self.memory();
        let film = memory.film.iter().map(|&word| ubitsf(word));
        (film, memory.counters)
    }
}
