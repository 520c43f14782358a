//! Scene file -> scene -> prepared -> integrator -> film -> sensor -> image.
pub mod scene;
pub mod film;
pub mod integrator;
pub mod layers;
pub mod prepare;
pub mod image;
pub mod sensor;
