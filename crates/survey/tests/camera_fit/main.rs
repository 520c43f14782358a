//! A vehicle's values found from pictures with known truth.

mod beam;
mod draw;
mod level;
mod noise;
mod response;
mod vignetting;
