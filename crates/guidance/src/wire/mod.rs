//! The wire protocol `uwguide/1`: newline-delimited JSON, one object a line.
//!
//! Bytes become lines ([`frame`]), lines requests ([`request`]), and answers lines again ([`reply`]).

pub mod frame;
pub mod reply;
pub mod request;
