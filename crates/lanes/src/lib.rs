//! The compute kernels of `shaders/` on the processor's vector units: a group of pixels at once, a lane each.
//!
//! `build/` turns the kernels into Rust, once for every instruction set; what each of its lines does is in [`portable`]
//! and, with the instructions of x86, in `avx2`. Nothing of light or water is written here.

mod elementary;
mod memory;

use memory::Memory;
pub use memory::{COUNTERS, DISPATCH_WORDS, Tables};

mod portable;

#[cfg(target_arch = "x86_64")]
mod avx2;

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
}

impl Instructions {
    /// The best that this processor has.
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            return Self::Avx2;
        }
        Self::Portable
    }

    /// Pixels of a group.
    pub fn lanes(self) -> u32 {
        match self {
            Self::Portable => portable::LANES as u32,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::LANES as u32,
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 => portable::LANES as u32,
        }
    }
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
        }
    };
}

generated!(lamps_portable, portable, "lamps_portable");
generated!(ambient_portable, portable, "ambient_portable");
#[cfg(target_arch = "x86_64")]
generated!(lamps_avx2, avx2, "lamps_avx2");
#[cfg(target_arch = "x86_64")]
generated!(ambient_avx2, avx2, "ambient_avx2");

enum State<'a> {
    LampsPortable(Box<lamps_portable::State<'a>>),
    AmbientPortable(Box<ambient_portable::State<'a>>),
    #[cfg(target_arch = "x86_64")]
    LampsAvx2(Box<lamps_avx2::State<'a>>),
    #[cfg(target_arch = "x86_64")]
    AmbientAvx2(Box<ambient_avx2::State<'a>>),
}

/// A group of lanes that runs one kernel, and its memory.
pub struct Group<'a> {
    state: State<'a>,
    layers: u32,
}

impl<'a> Group<'a> {
    /// A group for the scene of `tables`, whose switches (override constants) are told by `is_on`. `slots` is the number
    /// of places for the vertices of a lane's paths, `film_layers` that of the film's layers.
    ///
    /// `instructions` that the processor lacks are taken for portable ones.
    pub fn new(
        kernel: Kernel,
        instructions: Instructions,
        tables: &Tables<'a>,
        (slots, film_layers): (u32, u32),
        is_on: &dyn Fn(&str) -> bool,
    ) -> Self {
        let lanes = instructions.lanes() as usize;
        let memory = Memory::new(tables, lanes, slots, film_layers);
        let state = match (kernel, instructions) {
            #[cfg(target_arch = "x86_64")]
            (Kernel::Lamps, Instructions::Avx2) if Instructions::best() == instructions => {
                // SAFETY: the processor has the instructions.
                State::LampsAvx2(Box::new(unsafe { lamps_avx2::new(memory, is_on) }))
            }
            #[cfg(target_arch = "x86_64")]
            (Kernel::Ambient, Instructions::Avx2) if Instructions::best() == instructions => {
                // SAFETY: the processor has the instructions.
                State::AmbientAvx2(Box::new(unsafe { ambient_avx2::new(memory, is_on) }))
            }
            (Kernel::Lamps, _) => {
                State::LampsPortable(Box::new(lamps_portable::new(memory, is_on)))
            }
            (Kernel::Ambient, _) => {
                State::AmbientPortable(Box::new(ambient_portable::new(memory, is_on)))
            }
        };
        Self {
            state,
            layers: film_layers,
        }
    }

    fn memory(&mut self) -> &mut Memory<'a> {
        match &mut self.state {
            State::LampsPortable(state) => &mut state.memory,
            State::AmbientPortable(state) => &mut state.memory,
            #[cfg(target_arch = "x86_64")]
            State::LampsAvx2(state) => &mut state.memory,
            #[cfg(target_arch = "x86_64")]
            State::AmbientAvx2(state) => &mut state.memory,
        }
    }

    /// Makes the samples of `dispatch` (the words of its record) from `first_pixel` on, at most as many pixels as there
    /// are lanes. Returns the film, per pixel its layers with the sums of three channels, and what the lanes counted.
    pub fn run(
        &mut self,
        first_pixel: u32,
        dispatch: [u32; DISPATCH_WORDS],
    ) -> (impl Iterator<Item = f32>, [u32; COUNTERS]) {
        let layers = self.layers;
        let memory = self.memory();
        memory.dispatch = dispatch;
        memory.counters = [0; COUNTERS];
        // Words wrap around as the kernels' own do.
        memory.first_of_film = first_pixel.wrapping_mul(3 * layers);
        memory.first_of_completed = first_pixel;
        memory.film.fill(0);
        memory.completed.fill(0);
        match &mut self.state {
            State::LampsPortable(state) => lamps_portable::run(state),
            State::AmbientPortable(state) => ambient_portable::run(state),
            // SAFETY: such a state is made only where the processor has the instructions.
            #[cfg(target_arch = "x86_64")]
            State::LampsAvx2(state) => unsafe { lamps_avx2::run(state) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            State::AmbientAvx2(state) => unsafe { ambient_avx2::run(state) },
        }
        let memory = self.memory();
        let film = memory.film.iter().map(|&word| f32::from_bits(word));
        (film, memory.counters)
    }
}

#[cfg(test)]
mod tests;
