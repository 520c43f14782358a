//! What the program `uwguide` is beyond the guidance that `uw_guidance::daemon` serves.
//!
//! [`config`] reads its file, [`tls`] encrypts connections, [`links`] speak to what vehicles have already, [`log`] writes down
//! what happens.

pub mod config;
pub mod links;
pub mod log;
pub mod tls;

pub use config::{Config, ConfigError};
