//! The jobs of the command line `uw`: training sets, the demonstration, fits of water and vehicle, sequences.

pub mod camera_fit;
pub mod cli;
pub mod dataset;
pub mod demo;
pub mod fit;
pub mod photograph;
pub mod sequence;
pub mod treatment;
pub mod undistort;
