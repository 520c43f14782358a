//! What the kernels in `shaders/` are given, whatever runs them: the scene as records and tables, what is asked of them, and
//! their room.

mod fault;
mod lamp_groups;
pub mod layout;
mod order;
mod rays;
mod records;
mod room;
mod selection;
pub mod shaders;
pub(crate) mod spectra;
mod tables;
mod tree;
mod wide_tree;
pub(crate) mod words;

pub use fault::GpuError;
pub(crate) use rays::MOST_RAYS;
pub use rays::RayBatch;
pub(crate) use records::{Tables, Tracer};
pub(crate) use room::{Room, switches};
pub use selection::Selection;
pub(crate) use selection::Work;

use crate::prepare::Prepared;
use layout::Dispatch;

/// Levels of the lamps, as fractions.
pub(crate) fn levels(scene: &Prepared) -> Vec<f64> {
    scene.lamps.iter().map(|lamp| lamp.level).collect()
}

impl Dispatch {
    /// Sample after sample of `batch_samples` samples of a batch, as many as are left, in as many lanes as there are.
    pub(crate) fn new(
        seed: u64,
        (batch, batch_samples): (u32, u32),
        lanes: u32,
        room: Room,
    ) -> Self {
        Self {
            seed_low: seed as u32,
            seed_high: (seed >> 32) as u32,
            batch,
            batch_samples,
            samples: batch_samples,
            max_events: u32::MAX,
            slots: room.slots,
            lanes,
            queued: room.queued,
            most_segments: room.most_segments,
            ..bytemuck::Zeroable::zeroed()
        }
    }
}
