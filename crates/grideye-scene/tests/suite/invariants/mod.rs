//! Invariants of every scene, however it is turned, mirrored, moved or hidden.

mod frames;
mod picture;

use crate::{CEILING, ROOM, object, picture, scene, simulator};
use grideye_frame::{Celsius, PixelIndex};
use grideye_scene::perceived::{Law, Surface, perceived_celsius};
use grideye_scene::{Image, Scene, Simulator};
use proptest::prelude::*;
use std::time::Duration;

const AMBIENT_C: f64 = 20.1;

/// Largest difference, °C, of two frames of the same surfaces: they may be cut into other pieces, and the rule that
/// integrates over a piece is not exact.
const RULE_C: f64 = 1e-6;

fn assert_close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (pixel, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!(
            (found - expected).abs() < RULE_C,
            "pixel {pixel}: {found}, expected {expected}"
        );
    }
}

/// Rows of an 8 x 8 image with their columns reversed.
fn left_right(picture: &[f64]) -> Vec<f64> {
    picture
        .chunks_exact(8)
        .flat_map(|row| row.iter().rev())
        .copied()
        .collect()
}

fn warmest(picture: &[f64]) -> (usize, usize) {
    let index = (0..64)
        .max_by(|one, other| picture[*one].total_cmp(&picture[*other]))
        .unwrap();
    (index / 8, index % 8)
}
