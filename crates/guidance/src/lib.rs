//! Guidance: where a vehicle should go and how bright its lamps should be, for contrast and coverage.
//!
//! The way of the data, a file each:
//!
//! 1. [`observation`]: what the vehicle knows now.
//! 2. [`features`]: the network's inputs, one table of names, units and meanings.
//! 3. [`mlp`] and [`model_file`]: the network that predicts contrast for a candidate.
//! 4. [`objective`]: contrast against distance, one score for a candidate.
//! 5. [`nelder_mead`] and [`optimise`]: the candidate with the best score.
//! 6. [`checks`] and [`reason`]: whether the network knows the place, and whether moving is worth it.
//! 7. [`advice`]: all of it as one pure function, no socket in sight.
//! 8. [`wire`], [`service`], [`daemon`]: the same over TCP. `crates/daemon` makes the program `uwguide` of it.
//!
//! ```no_run
//! use uw_guidance::{Checks, Model, Objective, Observation, advise_checked};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let model = Model::read("model.json".as_ref())?;
//! let profile = uw_calib::Profile::read("profile.json".as_ref())?;
//! let now = Observation {
//!     depth_m: 3.0, distance_m: 1.0, light_pct: 20.0,
//!     mean: [41.0, 88.0, 79.0], std: [4.1, 7.7, 6.2],
//!     quality: None,
//! };
//! let advice = advise_checked(&now, &profile, &model, &Objective::default(), &Checks::default());
//! assert!(advice.valid());
//! # Ok(()) }
//! ```

pub mod advice;
pub mod beams;
pub mod card;
pub mod checks;
pub mod daemon;
pub mod features;
pub mod feed;
pub mod gauges;
pub mod metrics;
pub mod mlp;
pub mod model_file;
pub mod nelder_mead;
pub mod objective;
pub mod observation;
pub mod operations;
pub mod optimise;
pub mod physics;
mod question;
pub mod reason;
pub mod record;
pub mod replay;
pub mod service;
pub mod steering;
pub mod wire;

pub use advice::{Advice, Reason, advise, advise_checked};
pub use card::Card;
pub use checks::{Checks, Residual, Strictness};
pub use daemon::{Daemon, Limits, Running, spawn};
pub use features::{Candidate, Situation};
pub use mlp::Model;
pub use model_file::ModelError;
pub use objective::Objective;
pub use observation::Observation;
pub use service::Service;
