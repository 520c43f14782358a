//! Rays that are given: their light, one after the other.

use super::{QUEUED, Runner, Shared};
use crate::kernels::{RayBatch, Work, layout::Dispatch};

/// One worker: groups of lanes that live as long as its thread.
pub(crate) struct RayWorker<'a> {
    shared: &'a Shared<'a>,
    runners: Vec<Runner<'a>>,
}

impl<'a> RayWorker<'a> {
    /// For what was prepared for rays.
    pub(crate) fn new(shared: &'a Shared<'a>) -> Self {
        Self {
            shared,
            runners: shared.runners(),
        }
    }

    /// Most rays of a run.
    pub(crate) fn most_rays(&self) -> usize {
        (self.shared.precision.lanes() * QUEUED) as usize
    }

    /// Adds the light of rays to the sums of their layers. `rows` are their origin and, at most [`RayWorker::most_rays`],
    /// their directions, four numbers each; the first is sample `first` of `batch`.
    pub(crate) fn run(
        &mut self,
        batch: &RayBatch,
        first: u32,
        rows: &[f64],
        sums: &mut [f64],
    ) -> Work {
        let dispatch = Dispatch {
            pixel_count: (rows.len() / 4 - 1) as u32,
            ray_key: batch.key,
            first_ray: first,
            ..self.shared.dispatch(batch.seed, (batch.batch, 1))
        };
        let mut work = Work::default();
        for runner in &mut self.runners {
            runner.set_rays(rows);
            work.add_counters(runner.run(&dispatch, sums));
        }
        work
    }
}
