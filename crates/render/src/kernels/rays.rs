//! Rays that are given to the kernels.

/// Most rays that are given at once: the rows of `rays` in `shaders/common/layout.wgsl` but that of their origin.
pub(crate) const MOST_RAYS: usize = 4095;

/// What keys the random numbers of rays. Within a batch the leading numbers of rays are points of one scrambled sequence;
/// batches and keys are independent of each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayBatch {
    /// Seed of all random numbers.
    pub seed: u64,
    /// What separates estimates, as pixels are in a picture.
    pub key: u32,
    /// Number of the batch.
    pub batch: u32,
    /// Number of the first ray in its batch; that of the last is below [`crate::sampling::MAX_BATCH`].
    pub first: u32,
}
