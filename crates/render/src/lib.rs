//! Scene file -> scene -> prepared -> integrator -> film -> sensor -> image.
pub mod backend;
pub mod denoise;
pub mod film;
pub mod gpu;
pub mod image;
pub mod integrator;
pub mod irradiance;
mod kernels;
pub mod layers;
pub mod prepare;
mod processor;
pub mod ray_spectrum;
pub mod rays;
pub mod sampling;
pub mod scene;
pub mod sensor;
pub mod snow;
