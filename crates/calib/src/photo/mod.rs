//! Photographs before they are measured: what a camera says of them ([`exif`]), one exposure for all ([`exposures`]), without what is
//! not the target ([`mask`]), as an ideal camera would have taken them ([`resampling`], kept by [`Undistortion`]), a folder of frames as one ([`frames`]).
//! [`Treatment`] does it, [`Opened`] is what comes out, and [`Origin`] what it has of the stored pictures' noise.

pub mod exif;
pub(crate) mod exposures;
pub mod frames;
mod lights;
pub mod mask;
mod opened;
mod origin;
pub mod resampling;
mod undistortion;

#[cfg(test)]
mod tests;

pub use exif::Shot;
pub use exposures::{Exposed, exposed};
pub(crate) use lights::{FULL, Lights};
pub use mask::{Mask, MaskError};
pub use opened::{Opened, Treatment, View};
pub use origin::{Origin, PatchOrigin};
pub use resampling::Resampling;
pub use undistortion::{Undistortion, UndistortionError};
