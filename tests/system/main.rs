//! System tests: whole renders against closed forms and independent references.

#![allow(
    clippy::print_stdout,
    reason = "tests print the deviations they measured"
)]

mod agreement;
mod air_lamps;
mod beams;
mod camera_models;
mod closed_form;
mod cloud_daylight;
mod convergence;
mod estimated_error;
mod far_lamps;
mod furnace;
mod gloss;
mod irradiance_by_cameras;
mod irradiance_sensors;
mod layered_daylight;
mod layers;
mod near_lamps;
mod radiative_transfer;
mod reference_scenes;
mod scales;
mod spectral;
mod spectral_sums;
mod stress;
mod symmetries;
mod thin_lens;
mod units;
mod validator;
mod varying_water;
mod water_surface;
