//! Tests the simulator from outside: against an independent ray caster, against the reference's numbers, and with every
//! possible mistake in a scene file.

#![expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that panics has failed, and its counts are small"
)]

mod area;
mod collision;

mod invariants;
mod motion;
mod paper_scenes;
mod peer;
mod people;
mod physical;
mod physical_invariants;
mod physical_people;
mod postures;
mod range;
mod refusals;
mod rooms;
mod shapes;
mod shipped;
mod support;
mod symmetry;
mod uncertain;
mod unseen;
mod variants;
mod warmth;

use grideye_scene::Simulator;
use std::time::Duration;
pub(crate) use support::{CEILING, ROOM, no_files, object, parse, scene};

pub(crate) fn simulator(text: &str) -> Simulator {
    let scene = scene(text);
    let name = scene.sensors()[0].name.clone();
    Simulator::new(&scene, &name).unwrap()
}

/// The noise-free image of the first sensor at time 0, row by row.
pub(crate) fn picture(text: &str) -> Vec<f64> {
    simulator(text).image(Duration::ZERO).celsius
}
