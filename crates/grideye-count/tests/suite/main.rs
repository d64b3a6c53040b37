//! The counter as its users call it.
#![expect(
    clippy::unwrap_used,
    clippy::as_conversions,
    clippy::indexing_slicing,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    reason = "a test that fails here has failed, and its numbers are small"
)]

mod linaige;
mod network;
mod people;
