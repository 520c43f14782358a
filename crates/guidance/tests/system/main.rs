//! Tests of the whole crate, in one binary so that they link once.

mod answers;
mod binary;
mod checks;
mod client;
mod daemon;
mod dvl_stream;
mod faults;
mod links;
mod model;
#[cfg(unix)]
mod operations;
mod optimum;
mod protocol;
mod refusals;
mod rugged;
mod support;
