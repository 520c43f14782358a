//! Scene file -> scene -> prepared -> integrator -> film -> sensor -> image.
pub mod backend;
pub mod film;
pub mod gpu;
pub mod image;
pub mod integrator;
pub mod irradiance;
pub mod layers;
pub mod prepare;
pub mod scene;
pub mod sensor;
