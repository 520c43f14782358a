//! Water as numbers: inherent optical properties, phase functions, the air-water interface.

mod bands;
mod error;
pub mod interface;
mod iops;
mod jerlov;
pub mod phase;
mod tables;
pub mod transmittance;

pub use bands::{Bands, Camera, Interval, channel_iops};
pub use error::MediaError;
pub use iops::Iops;
pub use jerlov::{SpectralIop, WaterType, spectrum};
