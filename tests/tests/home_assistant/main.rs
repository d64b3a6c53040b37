//! The bridge to Home Assistant, as Debian's mosquitto hears it, and as the real Home Assistant shows it.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

mod absent;
mod feed;
mod kept;
mod real;
mod removed;
mod trust;
mod values;
