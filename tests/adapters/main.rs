//! Kernels in single precision, on adapters and vector units, against those in double precision, and their shaders.
//!
//! A process of their own: a driver on the processor keeps what it compiles until the device goes, some hundred megabytes
//! for each scene that asks for other kernels.

#![allow(
    clippy::print_stdout,
    reason = "tests print the deviations they measured"
)]

mod gpu;
mod gpu_conditions;
mod gpu_features;
mod gpu_shaders;
