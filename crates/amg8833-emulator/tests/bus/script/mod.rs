//! Faults by script: in time, by frame, by chance, from a file; and what a file can have wrong.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

mod file;
mod properties;
mod rules;
mod support;
