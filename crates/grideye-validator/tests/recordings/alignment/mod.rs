//! Alignment of walks with known delay, rate and orientation, and of wrong scenes: what it finds, what it
//! regains, and that nothing wrong is made to agree.
#![expect(
    clippy::unwrap_used,
    clippy::as_conversions,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "what fails in a helper fails the test, and its counts are small"
)]

mod bench;
mod findings;
mod recovery;
mod wrong_scenes;
