//! Answers to questions about scenes, tested from outside: against closed forms, marches along rays, the simulator's
//! own frames, and all pairs.

#![expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that panics has failed, and its counts are small"
)]

mod bodies;
mod coverage;
mod drawing;
mod fusion;
mod ground;
mod paper_scenarios;
mod people;
#[path = "../../../grideye-scene/tests/suite/support.rs"]
mod support;

use support::{CEILING, ROOM, object, parse, scene};
