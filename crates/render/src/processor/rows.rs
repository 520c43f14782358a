//! Rows of pixels: the samples of a batch, added to a row of the film.

use super::{QUEUED, Runner, Shared};
use crate::{
    film::{BatchMean, Row},
    kernels::{Work, layout::Dispatch},
};

/// Which samples of which row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowBatch {
    /// Seed of the render.
    pub(crate) seed: u64,
    /// Index of the row, from the top.
    pub(crate) row: u32,
    /// Number of the batch.
    pub(crate) batch: u32,
    /// Samples per pixel, at least 1.
    pub(crate) samples: u32,
}

/// One worker: groups of lanes that live as long as its thread.
pub(crate) struct RowWorker<'a> {
    shared: &'a Shared<'a>,
    runners: Vec<Runner<'a>>,
    sums: Vec<f64>,
    /// What was done so far.
    pub(crate) work: Work,
}

impl<'a> RowWorker<'a> {
    pub(crate) fn new(shared: &'a Shared<'a>) -> Self {
        Self {
            shared,
            runners: shared.runners(),
            sums: Vec::new(),
            work: Work::default(),
        }
    }

    /// Adds a batch of samples to `row`. `stop` is asked before every group of pixels; where it says so the row stays as it
    /// was. Returns whether the batch was added.
    pub(crate) fn add_row(&mut self, at: RowBatch, row: &mut Row, stop: &dyn Fn() -> bool) -> bool {
        let words = 3 * self.shared.tables.scene.film_layers as usize;
        let mut sums = std::mem::take(&mut self.sums);
        sums.clear();
        sums.resize(self.shared.scene.camera.width as usize * words, 0.0);
        let complete = self.sum_row(at, &mut sums, words, stop);
        if complete {
            let lamps = self.shared.scene.lamps.len();
            for (column, sums) in sums.chunks_exact(words).enumerate() {
                let mean = BatchMean::of_sums(sums, at.samples, &self.shared.levels);
                row.add(column, lamps, &mean, at.samples);
            }
            row.finish_batch(at.samples);
        }
        self.sums = sums;
        complete
    }

    /// Adds up the layers of a row, `words` sums a pixel; `false` when stopped.
    fn sum_row(
        &mut self,
        at: RowBatch,
        sums: &mut [f64],
        words: usize,
        stop: &dyn Fn() -> bool,
    ) -> bool {
        let pixels = self.shared.precision.lanes() * (QUEUED / at.samples).max(1);
        let mut first_pixel = at.row * self.shared.scene.camera.width;
        for sums in sums.chunks_mut(pixels as usize * words) {
            if stop() {
                return false;
            }
            let pixel_count = (sums.len() / words) as u32;
            let dispatch = Dispatch {
                first_pixel,
                pixel_count,
                ..self.shared.dispatch(at.seed, (at.batch, at.samples))
            };
            for runner in &mut self.runners {
                self.work.add_counters(runner.run(&dispatch, sums));
            }
            first_pixel += pixel_count;
        }
        true
    }
}
