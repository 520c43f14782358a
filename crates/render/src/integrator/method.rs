//! How rows of pixels are rendered: by the native path tracer or by the kernels on vector units.

use super::{
    Plan,
    cpu::{self, RowBatch, Selection, Work},
    lanes::{self, Precision},
    select,
};
use crate::{film::Row, gpu::GpuError, prepare::Prepared};

/// Most samples that vector units make in the time of one by the native path tracer.
const MOST_SPEED_OF_LANES: f64 = 4.0;

/// What all workers of a render share.
pub(super) enum Method<'a> {
    Native {
        scene: &'a Prepared,
        selection: Selection,
    },
    Lanes(Box<lanes::Shared<'a>>),
}

impl<'a> Method<'a> {
    pub(super) fn native(scene: &'a Prepared, plan: &Plan) -> Self {
        let selection = select(scene, plan);
        Self::Native { scene, selection }
    }

    /// The kernels, made in `precision`; they share no walks.
    ///
    /// # Errors
    /// [`GpuError::Limit`] when the scene has more triangles than indices can name.
    pub(super) fn kernels(
        scene: &'a Prepared,
        plan: &Plan,
        precision: Precision,
    ) -> Result<Self, GpuError> {
        let shared = lanes::Shared::new(scene, &select(scene, plan), precision)?;
        Ok(Self::Lanes(Box::new(shared)))
    }

    /// "cpu" or "cpu-simd"; "cpu-kernels" for the kernels in double precision.
    pub(super) fn backend(&self) -> &'static str {
        match self {
            Self::Native { .. } => "cpu",
            Self::Lanes(shared) => match shared.precision {
                Precision::Single(_) => "cpu-simd",
                Precision::Double => "cpu-kernels",
            },
        }
    }

    /// Most samples that it makes in the time of one by the native path tracer.
    pub(super) fn speed(&self) -> f64 {
        match self {
            Self::Native { .. } => 1.0,
            Self::Lanes(shared) => match shared.precision {
                Precision::Single(_) => MOST_SPEED_OF_LANES,
                Precision::Double => 1.0,
            },
        }
    }

    /// The instructions of the vector units.
    pub(super) fn adapter(&self) -> Option<String> {
        match self {
            Self::Native { .. } => None,
            Self::Lanes(shared) => match shared.precision {
                Precision::Single(instructions) => Some(instructions.to_string()),
                Precision::Double => None,
            },
        }
    }

    /// Most neighbouring pixels that share walks.
    pub(super) fn share_walks(&self) -> u32 {
        match self {
            Self::Native { scene, selection } if selection.shares(scene) => selection.share_walks,
            _ => 1,
        }
    }

    /// What renders rows on one thread.
    pub(super) fn worker(&self) -> RowWorker<'_> {
        match self {
            Self::Native { scene, selection } => {
                RowWorker::Native(Box::new(cpu::Worker::new(scene, selection)))
            }
            Self::Lanes(shared) => RowWorker::Lanes(lanes::Worker::new(shared)),
        }
    }
}

/// What one thread has done.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Done {
    pub(super) work: Work,
    /// Paths that were ended by a limit of the kernels.
    pub(super) cut_paths: u64,
    /// Contributions of light that were left out because they were no finite numbers of single precision.
    pub(super) lost_light: u64,
}

/// What renders rows on one thread.
pub(super) enum RowWorker<'a> {
    Native(Box<cpu::Worker<'a>>),
    Lanes(lanes::Worker<'a>),
}

impl RowWorker<'_> {
    /// What was done so far.
    pub(super) fn work(&self) -> Done {
        match self {
            Self::Native(worker) => Done {
                work: worker.work,
                cut_paths: 0,
                lost_light: 0,
            },
            Self::Lanes(worker) => worker.done,
        }
    }

    /// Adds a batch of samples to `row`. `stop` is asked every now and then; where it says so the row stays as it was.
    /// Returns whether the batch was added.
    pub(super) fn add_row(&mut self, at: RowBatch, row: &mut Row, stop: &dyn Fn() -> bool) -> bool {
        match self {
            Self::Native(worker) => worker.add_row(at, row, stop),
            Self::Lanes(worker) => worker.add_row(at, row, stop),
        }
    }
}
