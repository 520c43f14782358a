//! Paths of the estimates: where they are traced, and the numbers that choose their directions.

use std::ops::Range;

use uw_render::backend::Device;
use uw_render::rays::RayBatch;
use uw_render::sampling::{Draws, MAX_BATCH};

/// All paths are traced on the processor's vector units.
pub(super) static DEVICE: Device = Device::CpuSimd;

/// Paths of one group, within one batch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Batch {
    key: RayBatch,
    paths: u32,
}

/// The batches of the paths `samples` of a group.
pub(super) fn batches(seed: u64, group: u32, samples: Range<u32>) -> impl Iterator<Item = Batch> {
    let first_batch = samples.start / MAX_BATCH;
    let end = samples.end.div_ceil(MAX_BATCH);
    (first_batch..end).map(move |batch| {
        let start = samples.start.max(batch * MAX_BATCH);
        Batch {
            key: RayBatch {
                seed,
                key: group,
                batch,
                first: start % MAX_BATCH,
            },
            paths: samples.end.min((batch + 1).saturating_mul(MAX_BATCH)) - start,
        }
    })
}

impl Batch {
    /// What keys its rays.
    pub(super) fn key(&self) -> RayBatch {
        self.key
    }

    /// Two numbers in (0, 1) for the direction of each path.
    pub(super) fn numbers(&self) -> impl Iterator<Item = (f64, f64)> {
        let RayBatch {
            seed,
            key,
            batch,
            first,
        } = self.key;
        (first..first + self.paths).map(move |index| {
            let draws = Draws::new(seed, key, batch, index, 0);
            (draws.leading(0), draws.leading(1))
        })
    }
}
