//! Scene file -> scene -> prepared -> integrator -> film -> sensor -> image.
pub mod scene;
