//! Trains the network that predicts image contrast after a move of vehicle or lamp.
//!
//! A table of image pairs made by `uw dataset` goes in, a `uw-mlp` model file that `uwguide` and
//! `uw predict` read comes out. The stages are files, in this order:
//!
//! | stage | file | what it holds |
//! |---|---|---|
//! | 1 | [`columns`] | names and units of the 20 inputs and 3 outputs |
//! | 2 | [`table`] | the table, Parquet or CSV, as checked rows |
//! | 3 | [`split`] | which rows are trained on and which are kept for the test |
//! | 4 | [`normalisation`] | mean and standard deviation of each input over the training rows |
//! | 5 | [`mod@train`] | the network (20-128-128-3, ReLU), Adam on the mean absolute error, the learning curve |
//! | 6 | [`comparison`] | the same without calibration, split by environment, and in environments never seen |
//! | 7 | [`card`], [`model_file`], [`report`], [`plots`], [`output`] | the result, written whole or not at all |
//!
//! Everything random (split, initial weights, order of the rows) comes from one seed through
//! the crate's own generator, and the arithmetic runs on one thread in a fixed order: the same
//! command gives the same model bytes on the same machine.

pub mod card;
pub mod columns;
pub mod comparison;
mod error;
pub mod model_file;
mod network;
pub mod normalisation;
pub mod output;
mod parquet_file;
pub mod plots;
pub mod report;
mod rng;
pub mod split;
pub mod table;
pub mod train;

pub use card::Pictures;
pub use columns::Offsets;
pub use comparison::{Comparison, UnseenSet};
pub use error::Error;
pub use model_file::Model;
pub use report::Report;
pub use split::{Split, SplitBy};
pub use table::Table;
pub use train::{Schedule, Settings, Trained, train};
