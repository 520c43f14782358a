//! Random numbers and directions.

mod circle;
pub mod directions;
mod draws;
mod rng;
pub(crate) mod sobol;

pub use circle::circle;
pub use draws::{Draws, LEADING, MAX_BATCH};
pub use rng::Rng;
