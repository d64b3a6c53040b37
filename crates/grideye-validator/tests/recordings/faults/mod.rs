//! Faults planted into recordings of right scenes, each over many seeds, and right scenes without a fault.
//!
//! What was chosen by looking at results was chosen on the scenes of [`bench::CHOSEN_ON`] with seeds from 0 on. Here
//! seeds run from [`bench::FIRST_SEED`] on, and the scenes of [`bench::HELD_OUT`] took no part in any choice.
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
