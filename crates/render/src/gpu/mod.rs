//! The kernels as compute shaders of a graphics adapter.
//!
//! They run a batch in dispatches that are short enough for display drivers. A lane makes some samples of one pixel and
//! moves their sum to the film; the host adds the batch to the same film as the processor.

mod bindings;
mod compiled;
mod device;
mod dispatches;
#[cfg(test)]
mod faults;
#[cfg(test)]
mod functions;
mod held;
mod pipeline;
mod pruned;
mod rays;
mod render;
mod shared;
pub mod skipped;
mod stepper;

pub use device::{AdapterChoice, AdapterInfo, Gpu, adapters};
pub use held::{Look, Statistics};
pub(crate) use rays::RayKernels;
pub use render::render;
pub use stepper::AdapterStepper;

pub use crate::kernels::{GpuError, layout, shaders};
