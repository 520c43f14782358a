//! Why a render could not be made.

use super::threads::ThreadsError;
use crate::{film::NotFinite, kernels::GpuError};

/// Why a render could not be made.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The worker threads could not be started.
    #[error(transparent)]
    Threads(#[from] ThreadsError),
    /// Stopped before every row had a sample.
    #[error("stopped after {rows} of {total} rows, before the picture was complete")]
    Incomplete {
        /// Rows finished.
        rows: usize,
        /// Rows in all.
        total: usize,
    },
    /// The GPU cannot be used.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The film holds values that are no numbers.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
    /// Kernels met light that is no number, or too much of it for single precision.
    #[error(
        "{count} contributions of light are no finite numbers of single precision; nothing of such a render can be used"
    )]
    LightLost {
        /// Number of contributions that were left out.
        count: u64,
    },
}
