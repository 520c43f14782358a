//! The vehicle before its target in simulation.
//!
//! [`environment`] makes the scenes of its views, of the water, the target and the vehicle; [`estimate`] tells what its camera stores
//! in a fraction of a render's time, [`measure`] renders it; [`routine`] is the calibration, [`daylight`] its K_z where no picture looks up.

pub mod daylight;
pub mod environment;
pub mod estimate;
pub mod measure;
pub mod routine;
