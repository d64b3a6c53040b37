//! Faults planted into recordings of right scenes, over many seeds, and right scenes without a fault.
//!
//! All choices that looked at results used the scenes of [`bench::CHOSEN_ON`] with seeds from 0. These tests use seeds
//! from [`bench::FIRST_SEED`], and the scenes of [`bench::HELD_OUT`] took no part in any choice.
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
