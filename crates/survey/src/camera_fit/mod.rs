//! A vehicle's values from what its user has: frames of a still view, and the data sheet of a lamp.
//!
//! [`noise`] finds the sensor's noise: [`frames`] brings the frames to linear light, [`bins`] sorts pixels by signal, [`line`]
//! draws the straight line of variance against signal. [`response`] finds the curve between light and counts from pictures at known
//! light, [`vignetting`] what the lens leaves of the light away from the middle ([`even`] takes it out of pictures), [`beam`] a lamp's intensity by angle from pictures of
//! a board, [`level`] its light by the level it is set to, [`lamp`] turns lumens and a beam angle into a scene's lamp.

pub mod beam;
mod bins;
pub mod even;
mod frames;
pub mod lamp;
pub mod level;
mod line;
pub mod noise;
pub mod response;
mod solve;
pub mod vignetting;

pub use frames::FramesError;
