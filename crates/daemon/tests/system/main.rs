//! Tests of the whole crate, in one binary so that they link once.

mod alone;
mod answers;
mod binary;
mod checks;
mod client;
mod daemon;
mod dark;
mod dvl_stream;
mod faults;
#[cfg(unix)]
mod files;
#[cfg(unix)]
mod known_water;
mod lens;
mod links;
mod model;
mod noise;
#[cfg(unix)]
mod operations;
mod optimum;
#[cfg(unix)]
mod physics;
#[cfg(unix)]
mod program;
mod protocol;
#[cfg(unix)]
mod recordings;
mod refusals;
mod rugged;
#[cfg(unix)]
mod safety;
mod strangers;
mod support;
mod vehicle;
