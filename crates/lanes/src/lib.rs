//! The compute kernels of `shaders/` on the processor's vector units: a group of pixels at once, a lane each.
//!
//! `build/` turns the kernels into Rust, once for every instruction set; what each of its lines does is in [`portable`]
//! and, with the instructions of x86, in `avx2` and `avx512`. Nothing of light or water is written here; the way through
//! triangles is, in [`tree`], because lanes go it better together.

mod elementary;
mod memory;
pub mod scalar;
pub mod tree;

use std::fmt;

use memory::Memory;
pub use memory::{COUNTERS, DISPATCH_WORDS, Tables};

mod portable;

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
    /// Those of every processor that Rust knows.
    Portable,
    /// AVX2 and fused multiplication.
    Avx2,
    /// The same, with the masks and registers of AVX-512.
    Avx512,
}

impl Instructions {
    /// All, from the slowest.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The best that this processor has.
    pub fn best() -> Self {
        let mut fastest_first = Self::ALL.into_iter().rev();
        let best = fastest_first.find(|set| set.are_here());
        best.unwrap_or(Self::Portable)
    }

    /// Whether this processor has them.
    #[cfg(target_arch = "x86_64")]
    pub fn are_here(self) -> bool {
        let has_avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        match self {
            Self::Portable => true,
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
        self == Self::Portable
    }
}

impl fmt::Display for Instructions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Portable => "portable vectors",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        })
    }
}

/// Pixels of a group.
pub const LANES: u32 = portable::LANES as u32;
#[cfg(target_arch = "x86_64")]
const _: () = assert!(portable::LANES == x86::LANES);

/// What a kernel for some instructions does. A state of instructions that the processor lacks is never made.
trait State<'a>: Send {
    fn memory(&mut self) -> &mut Memory<'a>;
    /// Runs the kernel on all lanes.
    fn run(&mut self);
}

/// A kernel as Rust, made by `build/`.
macro_rules! generated {
    ($name:ident, $lanes:ident, $file:literal) => {
        #[allow(
            clippy::all,
            nonstandard_style,
            unused,
            missing_docs,
            reason = "made by a program"
        )]
        mod $name {
            use crate::{memory::Memory, $lanes::*};
            include!(concat!(env!("OUT_DIR"), "/", $file, ".rs"));

            impl<'a> crate::State<'a> for State<'a> {
                fn memory(&mut self) -> &mut Memory<'a> {
                    &mut self.memory
                }

                fn run(&mut self) {
                    // SAFETY: the state was made, so that the processor has the instructions.
                    unsafe { run(self) }
                }
            }
        }
    };
}

generated!(lamps_portable, portable, "lamps_portable");
generated!(ambient_portable, portable, "ambient_portable");
#[cfg(target_arch = "x86_64")]
generated!(lamps_avx2, avx2, "lamps_avx2");
#[cfg(target_arch = "x86_64")]
generated!(ambient_avx2, avx2, "ambient_avx2");
#[cfg(target_arch = "x86_64")]
generated!(lamps_avx512, avx512, "lamps_avx512");
#[cfg(target_arch = "x86_64")]
generated!(ambient_avx512, avx512, "ambient_avx512");

/// A group of lanes that runs one kernel, and its memory.
pub struct Group<'a> {
    state: Box<dyn State<'a> + 'a>,
    layers: u32,
}

impl<'a> Group<'a> {
    /// A group for the scene of `tables`, whose switches (override constants) are told by `is_on`. `scratch_rows` is the
    /// number of rows of four words that a lane has for itself, `film_layers` that of the film's layers,
    /// `pixels` the most pixels that it makes in a run.
    ///
    /// `instructions` that the processor lacks are taken for portable ones.
    pub fn new(
        kernel: Kernel,
        instructions: Instructions,
        tables: &Tables<'a>,
        (scratch_rows, film_layers, pixels): (u32, u32, u32),
        is_on: &dyn Fn(&str) -> bool,
    ) -> Self {
        let memory = Memory::new(tables, LANES as usize, scratch_rows, film_layers, pixels);
        let are_here = instructions.are_here();
        let state: Box<dyn State<'a> + 'a> = match (kernel, instructions) {
            #[cfg(target_arch = "x86_64")]
            (Kernel::Lamps, Instructions::Avx512) if are_here => {
                // SAFETY: the processor has the instructions.
                Box::new(unsafe { lamps_avx512::new(memory, is_on) })
            }
            #[cfg(target_arch = "x86_64")]
            (Kernel::Ambient, Instructions::Avx512) if are_here => {
                // SAFETY: the processor has the instructions.
                Box::new(unsafe { ambient_avx512::new(memory, is_on) })
            }
            #[cfg(target_arch = "x86_64")]
            (Kernel::Lamps, Instructions::Avx2) if are_here => {
                // SAFETY: the processor has the instructions.
                Box::new(unsafe { lamps_avx2::new(memory, is_on) })
            }
            #[cfg(target_arch = "x86_64")]
            (Kernel::Ambient, Instructions::Avx2) if are_here => {
                // SAFETY: the processor has the instructions.
                Box::new(unsafe { ambient_avx2::new(memory, is_on) })
            }
            (Kernel::Lamps, _) => Box::new(lamps_portable::new(memory, is_on)),
            (Kernel::Ambient, _) => Box::new(ambient_portable::new(memory, is_on)),
        };
        Self {
            state,
            layers: film_layers,
        }
    }

    /// Makes the samples of `dispatch` (the words of its record) from `first_pixel` on, at most as many pixels as
    /// [`Group::new`] was told. Returns the film, per pixel its layers with the sums of three channels, and what the lanes counted.
    pub fn run(
        &mut self,
        first_pixel: u32,
        dispatch: [u32; DISPATCH_WORDS],
    ) -> (impl Iterator<Item = f32>, [u32; COUNTERS]) {
        let layers = self.layers;
        let memory = self.state.memory();
        memory.dispatch = dispatch;
        memory.counters = [0; COUNTERS];
        // Words wrap around as the kernels' own do.
        memory.first_of_film = first_pixel.wrapping_mul(3 * layers);
        memory.first_of_completed = first_pixel;
        memory.film.fill(0);
        memory.completed.fill(0);
        self.state.run();
        let memory = self.state.memory();
        let film = memory.film.iter().map(|&word| f32::from_bits(word));
        (film, memory.counters)
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod tree_tests;
