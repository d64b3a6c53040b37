//! The bridge to MQTT, tested with Debian's mosquitto and the real Home Assistant.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

mod absent;
mod feed;
mod kept;
mod real;
mod removed;
mod taken;
mod trust;
mod values;
