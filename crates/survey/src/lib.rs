//! Around the renderer: the command line `uw`, calibration routines, training sets, the demonstration, and the
//! scenery that they look at.

pub mod assets;
pub mod camera_fit;
pub mod cli;
pub mod dataset;
pub mod daylight;
pub mod demo;
pub mod environment;
pub mod error_time;
pub mod estimate;
pub mod fit;
pub mod measure;
pub mod photograph;
pub mod plot;
pub mod routine;
pub mod scenery;
pub mod sequence;
pub mod undistort;

pub use uw_calib::vehicle;
