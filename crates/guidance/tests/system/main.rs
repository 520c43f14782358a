//! Tests of the whole crate, in one binary so that they link once.

mod binary;
mod daemon;
mod model;
mod optimum;
mod support;
