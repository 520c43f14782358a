//! The viewer: the water, its knobs and the advice in one window.
//!
//! [`model`] is what the viewer knows, [`worker`] renders it on a thread of its own, [`guidance`] asks for advice,
//! `background` lets those threads step back, [`app`] ties them together, [`ui`] shows them, [`export`] writes plots, [`cli`] starts it all.

pub mod app;
mod background;
pub mod cli;
pub mod export;
pub mod guidance;
pub mod model;
pub mod ui;
pub mod window;
pub mod worker;
