//! Tests of the whole crate, in one binary so that they link once.

mod answers;
mod binary;
mod client;
mod daemon;
mod model;
mod optimum;
mod rugged;
mod support;
