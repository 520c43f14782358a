//! The numbers that a path is made of.

use uw_render::sampling::{Draws, LEADING, MAX_BATCH};

/// Evenly spread numbers for the first choices of a path, then random ones.
pub(super) struct Numbers {
    draws: Draws,
    used: usize,
}

impl Numbers {
    /// Those of a path's draws.
    pub(super) fn of(draws: Draws) -> Self {
        Self { draws, used: 0 }
    }

    /// Those of path `index` of `group`; `stream` keeps kinds of paths apart. They depend on nothing else, so that sets of paths for
    /// several phase functions differ smoothly.
    pub(super) fn of_path(seed: u64, stream: u32, group: u32, index: u32) -> Self {
        let (batch, index) = (index / MAX_BATCH, index % MAX_BATCH);
        Self::of(Draws::new(seed, group, batch, index, stream))
    }

    /// The next number, in (0, 1).
    #[inline]
    pub(super) fn next(&mut self) -> f64 {
        self.used += 1;
        if self.used <= LEADING {
            self.draws.leading(self.used - 1)
        } else {
            self.draws.uniform()
        }
    }

    /// The next number, in (0, 1), never one of the evenly spread ones.
    #[inline]
    pub(super) fn random(&mut self) -> f64 {
        self.draws.uniform()
    }
}
