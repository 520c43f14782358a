//! Photographs before they are measured: what a camera says of them ([`exif`]), one exposure for all ([`exposures`]), without what is
//! not the target ([`mask`]), as an ideal camera would have taken them ([`resampling`]), a folder of frames as one ([`frames`]).
//! [`Treatment`] does it, [`Opened`] is what comes out.

pub mod exif;
pub(crate) mod exposures;
pub mod frames;
mod lights;
pub mod mask;
mod opened;
pub mod resampling;

#[cfg(test)]
mod tests;

pub use exif::Shot;
pub(crate) use lights::{FULL, Lights};
pub use mask::{Mask, MaskError};
pub use opened::{Opened, Treatment, View};
pub use resampling::{Resampling, Undistortion};
