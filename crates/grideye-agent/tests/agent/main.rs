//! The agent's public API between emulated sensors and a small, misbehaving collector.
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "in the helpers of tests, which clippy does not take for tests; a panic is how they fail"
)]

mod acquisition;
mod check;
mod clocks;
mod config;
mod delivery;
mod faults;
mod files;
mod folder;
mod held;
mod hung;
mod join;
mod linux_bus;
mod model_disk;
mod outage;
#[expect(unreachable_pub, reason = "the tests of the whole share this file")]
#[path = "../../../../tests/src/patience.rs"]
mod patience;
mod program;
mod spool;
mod support;
mod table;
