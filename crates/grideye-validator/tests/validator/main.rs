//! The validator's public behavior, on frames made here: a warm blob in a room, seen by a sensor with noise, steps,
//! fixed pattern and offset. The simulator has no part in it.
#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot set up its frames has failed"
)]

mod pairs;
mod properties;
mod reports;
mod scenes;
mod toy;
mod verdicts;
