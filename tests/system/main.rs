//! System tests: whole renders against closed forms and independent references.

#![allow(
    clippy::print_stdout,
    reason = "tests print the deviations they measured"
)]

mod closed_form;
mod irradiance_sensors;
mod radiative_transfer;
mod reference_scenes;
mod validator;
mod water_surface;
