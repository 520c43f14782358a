//! Random numbers and directions.

pub mod directions;
mod draws;
mod rng;
pub(crate) mod sobol;

pub use draws::{Draws, LEADING, MAX_BATCH};
pub use rng::Rng;
