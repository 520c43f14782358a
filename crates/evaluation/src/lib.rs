//! Does the guidance pay? The published inspection experiment with real renders, and what the methods gain or lose.
//!
//! * [`vision`]: features, matches and gradients of images; [`niqe`]: how natural they look.
//! * [`operation`]: the inspection, method against method (`uweval operation`).
//! * [`contrast`]: contrast of the whole image against patches (`uweval contrast`); [`phase`]: phase functions
//!   (`uweval phase`).

pub mod cli;
pub mod contrast;
pub mod error;
pub mod files;
mod linear;
pub mod niqe;
pub mod operation;
pub mod phase;
pub mod plot;
pub mod vision;

pub use error::EvalError;
