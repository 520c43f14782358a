//! The GPU backend: the estimators of the CPU in f32, as compute kernels.
//!
//! Kernels run a batch in dispatches that are short enough for display drivers. A lane makes some samples of one pixel
//! and moves their mean to the film; the host adds the batch to the same film as the CPU.

mod compiled;
mod device;
mod error;
#[cfg(test)]
mod faults;
mod held;
pub mod layout;
pub(crate) mod pipeline;
pub(crate) mod render;
pub mod shaders;
mod shared;
pub mod skipped;
mod stepper;
mod tables;
mod tree;
#[cfg(test)]
mod twins;
pub(crate) mod upload;
mod wide_tree;
mod words;

pub use device::{AdapterChoice, AdapterInfo, Gpu, adapters};
pub use error::GpuError;
pub use held::{Look, Statistics};
pub use render::render;
pub use stepper::Stepper;
