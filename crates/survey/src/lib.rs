//! What surveys need around the renderer: for now, the scenery that they look at.

pub mod cli;
pub mod scenery;
pub mod assets;
pub mod dataset;
pub mod demo;
pub mod environment;
pub mod measure;
pub mod plot;
pub mod routine;
pub mod vehicle;
