//! The viewer: the water, its knobs and the advice in one window.
//!
//! [`model`] is what the viewer knows, [`worker`] renders it on a thread of its own, [`guidance`] asks for advice,
//! `background` lets those threads step back, [`app`] ties them together, [`ui`] shows them, [`export`] writes plots, [`cli`] starts it all;
//! `screen` says what to do where there is no screen.

pub mod app;
mod background;
pub mod cli;
pub mod export;
pub mod guidance;
pub mod model;
mod screen;
pub mod ui;
pub mod window;
pub mod worker;
