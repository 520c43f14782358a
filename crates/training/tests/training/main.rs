//! Tests of the training as its users meet it, in one binary because linking the deep-learning
//! library takes longer than running them.

mod bad_input;
mod card;
mod dataset;
mod learning;
mod parquet_table;
