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

    /// The next length in units of its mean, exponentially distributed.
    #[inline]
    pub(super) fn length(&mut self) -> f64 {
        -self.next().ln()
    }
}

/// The numbers of path `index` of a group; `stream` keeps kinds of paths apart.
pub(super) fn of_path(seed: u64, group: u32, stream: u32, index: u32) -> Numbers {
    let (batch, index) = (index / MAX_BATCH, index % MAX_BATCH);
    Numbers::of(Draws::new(seed, group, batch, index, stream))
}

/// The numbers of each of `paths` paths of a group; `stream` keeps kinds of paths apart.
pub(super) fn of_paths(
    seed: u64,
    group: u32,
    stream: u32,
    paths: u32,
) -> impl Iterator<Item = Numbers> {
    (0..paths.div_ceil(MAX_BATCH)).flat_map(move |batch| {
        let batch_draws = Draws::new(seed, group, batch, 0, stream);
        let first = batch * MAX_BATCH;
        (0..MAX_BATCH.min(paths - first)).map(move |index| Numbers::of(batch_draws.at(index)))
    })
}
