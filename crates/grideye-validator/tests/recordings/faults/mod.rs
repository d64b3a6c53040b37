//! Faults planted into recordings of right scenes, over many seeds, and right scenes without a fault.
#![expect(
    clippy::unwrap_used,
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "what fails in a helper fails the test, and its counts are small"
)]

mod bench;
mod planted;
mod real;
mod right;
