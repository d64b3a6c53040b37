//! Tests of the public behavior, on frames made here without the simulator: a warm blob in a room, seen by a sensor
//! with noise, steps, fixed pattern and offset.
#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot set up its frames has failed"
)]

mod by_utc;
mod metrics;
mod orient;
mod pairs;
mod places;
mod properties;
mod reports;
mod scenes;
mod scores;
mod thinning;
mod thresholds;
mod toy;
