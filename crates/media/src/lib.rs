//! Water as numbers: inherent optical properties, phase functions, the air-water interface.
mod iops;
pub mod phase;
pub use iops::Iops;
