//! Tests of the viewer: scene files and worker without a window, panels by clicking, the real program.

mod advice;
mod bad_files;
#[path = "../common/mod.rs"]
mod common;
mod copying;
mod denoising;
mod exports;
mod gallery;
mod inspecting;
mod lasting;
mod layout;
mod objects;
mod panels;
mod physics;
mod program;
mod scene_files;
mod shared;
mod snapshots;
mod support;
mod tooltips;
mod varying;
mod worker;
