//! The command line as a user meets it: the real binary on small inputs.

mod alone;
mod bad_input;
mod calibrate;
mod camera_fit;
mod denoise;
mod error_time;
mod first_contact;
mod fit;
mod interruption;
mod irradiance;
mod photographs;
mod pictures;
mod predict;
mod project;
mod render;
mod render_limits;
mod render_options;
mod sequence;
mod support;
mod water;
mod water_told;
