//! The counter as its users call it.
#![allow(
    clippy::unwrap_used,
    clippy::as_conversions,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    reason = "tests"
)]

mod linaige;
mod network;
mod people;
