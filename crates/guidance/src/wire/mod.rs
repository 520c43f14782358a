//! The wire protocol `uwguide/1`: newline-delimited JSON, one object a line.
//!
//! Bytes become lines ([`frame`], which ends where [`greeting`] sees another protocol), lines requests ([`request`], with the state in [`inputs`]), and answers lines again ([`reply`]).

pub mod frame;
pub mod greeting;
pub mod inputs;
pub mod reply;
pub mod request;
