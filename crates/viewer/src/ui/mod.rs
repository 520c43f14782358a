//! What is on the screen: a file per part.

pub mod camera;
mod canvas;
pub mod clouds;
mod depth_plot;
pub mod depth_profile;
pub mod files;
pub mod guidance;
pub mod help;
pub mod knobs;
pub mod lamps;
pub mod look;
pub mod menu;
pub mod operation;
mod overlay;
pub mod phase_plot;
pub mod picture;
pub mod pixel;
pub mod plots;
mod scale;
pub mod scene;
pub mod shortcuts;
pub mod snow;
pub mod spectra;
pub mod status;
pub mod theme;
pub mod toasts;
pub mod water;
