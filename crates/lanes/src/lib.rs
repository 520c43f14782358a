//! The compute kernels of `shaders/` on the processor's vector units: a group of pixels at once, a lane each.
//!
//! `build/` turns the kernels into Rust, once for every instruction set; what each of its lines does is in [`four`] and,
//! with the wider vectors of x86, in `avx2` and `avx512`. Nothing of light or water is written here; the way through
//! triangles is, in [`tree`], because lanes go it better together.

mod elementary;
mod four;
mod memory;
pub mod scalar;
pub mod tree;

use std::fmt;

use memory::Memory;
pub use memory::{COUNTERS, DISPATCH_WORDS, Tables};

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "x86_64")]
mod x86;

/// A kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Light of the lamps.
    Lamps,
    /// Sun, sky and emitting surfaces.
    Ambient,
}

/// Instructions that a group runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instructions {
    /// Those that every processor of the program's architecture has: SSE2, NEON.
    Baseline,
    /// SSE4.2.
    Sse4,
    /// AVX2 and fused multiplication.
    Avx2,
    /// The same, with the masks and registers of AVX-512.
    Avx512,
}

impl Instructions {
    /// All, from the slowest.
    pub const ALL: [Self; 4] = [Self::Baseline, Self::Sse4, Self::Avx2, Self::Avx512];

    /// The best that this processor has.
    pub fn best() -> Self {
        let mut fastest_first = Self::ALL.into_iter().rev();
        let best = fastest_first.find(|set| set.are_here());
        best.unwrap_or(Self::Baseline)
    }

    /// Whether this processor has them.
    #[cfg(target_arch = "x86_64")]
    pub fn are_here(self) -> bool {
        let has_avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        match self {
            Self::Baseline => true,
            Self::Sse4 => {
                is_x86_feature_detected!("sse4.2")
                    && is_x86_feature_detected!("popcnt")
                    && is_x86_feature_detected!("cmpxchg16b")
            }
            Self::Avx2 => has_avx2,
            Self::Avx512 => {
                has_avx2
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512bw")
            }
        }
    }

    /// Whether this processor has them.
    #[cfg(not(target_arch = "x86_64"))]
    pub fn are_here(self) -> bool {
        self == Self::Baseline
    }

    /// These, or those of every processor where this one lacks them.
    fn or_baseline(self) -> Self {
        if self.are_here() {
            self
        } else {
            Self::Baseline
        }
    }

    /// Lanes of a group, a pixel each.
    pub fn lanes(self) -> u32 {
        match self.or_baseline() {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 | Self::Avx512 => x86::LANES as u32,
            _ => four::LANES as u32,
        }
    }
}

impl fmt::Display for Instructions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Baseline => four::baseline::NAME,
            Self::Sse4 => "SSE4.2",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        })
    }
}

/// What a kernel for some instructions does. A state of instructions that the processor lacks is never made.
trait State: Send {
    /// Gives it rays: rows of four words, of their origin and of a direction each.
    fn set_rays(&mut self, rows: &[f32]);
    /// Runs the kernel on all lanes, for the samples of `dispatch` from `first_pixel` on.
    fn run(&mut self, first_pixel: u32, dispatch: [u32; DISPATCH_WORDS]);
    /// The words of the film and the counters.
    fn made(&self) -> (&[u32], [u32; COUNTERS]);
}

/// A kernel as Rust, made by `build/`.
macro_rules! generated {
    ($name:ident, $set:ident, $($lanes:ident)::+) => {
        #[allow(
            clippy::all,
            nonstandard_style,
            unused,
            missing_docs,
            reason = "made by a program"
        )]
        pub mod $name {
            use crate::$($lanes)::+::*;
            include!(concat!(env!("OUT_DIR"), "/", stringify!($name), "_", stringify!($set), ".rs"));

            type Memory<'a> = crate::memory::Memory<'a, LANES>;

            impl crate::State for State<'_> {
                fn set_rays(&mut self, rows: &[f32]) {
                    let words = rows.iter().map(|x| x.to_bits());
                    self.memory.rays.clear();
                    self.memory.rays.extend(words);
                }

                fn run(&mut self, first_pixel: u32, dispatch: [u32; crate::DISPATCH_WORDS]) {
                    self.memory.begin(first_pixel, dispatch);
                    // SAFETY: the state was made, so that the processor has the instructions.
                    unsafe { run(self) }
                }

                fn made(&self) -> (&[u32], [u32; crate::COUNTERS]) {
                    (&self.memory.film, self.memory.counters)
                }
            }
        }
    };
}

/// All kernels for some instructions.
macro_rules! kernels {
    ($set:ident, $($lanes:ident)::+) => {
        pub mod $set {
            generated!(lamps_plain, $set, $($lanes)::+);
            generated!(lamps_full, $set, $($lanes)::+);
            generated!(ambient_plain, $set, $($lanes)::+);
            generated!(ambient_full, $set, $($lanes)::+);
        }
    };
}

mod kernels {
    kernels!(baseline, four::baseline);
    #[cfg(target_arch = "x86_64")]
    kernels!(sse4, four::sse4);
    #[cfg(target_arch = "x86_64")]
    kernels!(avx2, avx2);
    #[cfg(target_arch = "x86_64")]
    kernels!(avx512, avx512);
}

/// A group of lanes that runs one kernel, and its memory.
pub struct Group<'a> {
    state: Box<dyn State + 'a>,
}

impl<'a> Group<'a> {
    /// A group for the scene of `tables`, whose switches (override constants) are told by `is_on`. `scratch_rows` is the
    /// number of rows of four words that a lane has for itself, `film_layers` that of the film's layers,
    /// `pixels` the most pixels that it makes in a run.
    ///
    /// In the place of `instructions` that the processor lacks are those of every processor.
    #[allow(unused_unsafe, reason = "those of every processor are safe")]
    pub fn new(
        kernel: Kernel,
        instructions: Instructions,
        tables: &Tables<'a>,
        (scratch_rows, film_layers, pixels): (u32, u32, u32),
        is_on: &dyn Fn(&str) -> bool,
    ) -> Self {
        let sizes = (scratch_rows, film_layers, pixels);
        let full = ["HAS_LAYERS", "HAS_GLOSS", "HAS_AIR_LAMPS"]
            .into_iter()
            .any(is_on);
        /// The state of a kernel for some instructions.
        macro_rules! state {
            ($set:ident) => {{
                use kernels::$set::*;
                let memory = Memory::new(tables, sizes);
                // SAFETY: the processor has the instructions.
                let state: Box<dyn State + 'a> = unsafe {
                    match (kernel, full) {
                        (Kernel::Lamps, false) => Box::new(lamps_plain::new(memory, is_on)),
                        (Kernel::Lamps, true) => Box::new(lamps_full::new(memory, is_on)),
                        (Kernel::Ambient, false) => Box::new(ambient_plain::new(memory, is_on)),
                        (Kernel::Ambient, true) => Box::new(ambient_full::new(memory, is_on)),
                    }
                };
                state
            }};
        }
        let state = match instructions.or_baseline() {
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512 => state!(avx512),
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2 => state!(avx2),
            #[cfg(target_arch = "x86_64")]
            Instructions::Sse4 => state!(sse4),
            _ => state!(baseline),
        };
        Self { state }
    }

    /// Gives a kernel that looks along given rays (`GIVEN_RAYS`) the rays of its next run: rows of four numbers, three of
    /// the point where all start and then three of each direction.
    pub fn set_rays(&mut self, rows: &[f32]) {
        self.state.set_rays(rows);
    }

    /// Makes the samples of `dispatch` (the words of its record) from `first_pixel` on, at most as many pixels as
    /// [`Group::new`] was told. Returns the film, per pixel its layers with the sums of three channels, and what the lanes counted.
    pub fn run(
        &mut self,
        first_pixel: u32,
        dispatch: [u32; DISPATCH_WORDS],
    ) -> (impl Iterator<Item = f32>, [u32; COUNTERS]) {
        self.state.run(first_pixel, dispatch);
        let (film, counters) = self.state.made();
        (film.iter().map(|&word| f32::from_bits(word)), counters)
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod tree_tests;
