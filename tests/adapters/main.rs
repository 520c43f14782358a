//! Kernels in single precision, on adapters and vector units, against those in double precision, and their shaders.

#![allow(
    clippy::print_stdout,
    reason = "tests print the deviations they measured"
)]

mod gpu;
mod gpu_conditions;
mod gpu_features;
mod gpu_shaders;
