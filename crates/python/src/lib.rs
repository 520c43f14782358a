//! What `uwguide` for Python is made of: the renderer, measures, calibration and guidance on numpy arrays.
//!
//! The package in `python/uwguide` checks and converts arguments and holds what users read; here is what needs the other crates.
//! Errors of theirs become `ValueError` with the same text ([`errors`]). What takes long runs on threads of its own without the
//! interpreter's lock and ends at Ctrl-C ([`interrupt`]); pictures become arrays without a copy ([`arrays`]).

mod arrays;
mod calibrate;
mod camera;
mod errors;
mod fit;
mod from_python;
mod guide;
mod interrupt;
mod irradiance;
mod numbers;
mod pictures;
mod profile;
mod render;
mod scene;
mod water;

use pyo3::prelude::*;

/// The compiled part of `uwguide`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::calibrate::calibrate;
    #[pymodule_export]
    use super::camera::Camera;
    #[pymodule_export]
    use super::fit::fit;
    #[pymodule_export]
    use super::guide::Answers;
    #[pymodule_export]
    use super::irradiance::irradiance;
    #[pymodule_export]
    use super::pictures::{
        contrast_of_counts, encode_png, expose, measure_file, measure_rgb8, measure_rgb16, save,
    };
    #[pymodule_export]
    use super::profile::Profile;
    #[pymodule_export]
    use super::render::render;
    #[pymodule_export]
    use super::scene::Scene;
    #[pymodule_export]
    use super::water::Water;
}
