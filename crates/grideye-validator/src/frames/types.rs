//! Real and simulated frames, the protocols that pair them, and the 64 pixels of a frame in °C.

use crate::names::named;
use crate::numbers::trimmed_mean;
use grideye_frame::{COLUMNS, PIXELS, PixelWord, ROWS, RecordedFrame};
use std::time::Duration;

named! {
    /// Which real frame meets which simulated one (PeerJ CS 11:e3124, "Experiments and results").
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Protocol {
        /// Nothing moves: every real frame meets every simulated one.
        Static = "static";
        /// Something moves: frame by frame, at equal times.
        Dynamic = "dynamic";
    }
}

/// A frame of the sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct RealFrame {
    /// Since the recording's first frame.
    pub time: Duration,
    /// Temperatures, °C, row by row.
    pub celsius: [f64; PIXELS],
    /// The frame `lag_frames` later, if recorded: the ceiling is made from these.
    pub later: Option<[f64; PIXELS]>,
}

/// A frame of the simulator.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedFrame {
    /// Since the start of the scene.
    pub time: Duration,
    /// Temperatures with the sensor's noise, °C, row by row.
    pub celsius: [f64; PIXELS],
    /// Temperatures without noise: the claim, from which warm pixels are read.
    pub noise_free: [f64; PIXELS],
}

named! {
    /// What is known of the empty room.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
    pub enum RoomSource {
        /// Only the scene without its people.
        #[default]
        Scene = "scene";
        /// The pattern of the unit's profile.
        Profile = "profile";
        /// What the recording shows while nobody is there.
        Recording = "recording";
    }
}

/// Temperatures of one frame, °C.
pub(crate) type Pixels = [f64; PIXELS];

/// Variance that rounding to the sensor's step of 0.25 °C adds: a twelfth of its square (Sheppard).
pub(crate) const STEP_VARIANCE: f64 = 0.25 * 0.25 / 12.0;

/// The sensor's step as the driver decodes it, °C.
#[must_use]
pub fn sensor_step_c() -> f64 {
    let decoded = |word| f64::from(grideye_frame::word::pixel_celsius(PixelWord(word)).get());
    decoded(1) - decoded(0)
}

pub(crate) fn decoded(raw: &RecordedFrame) -> Pixels {
    grideye_frame::word::pixels(&raw.pixels).map(|pixel| f64::from(pixel.get()))
}

/// Mean of the middle three quarters of the pixels, which a person hardly moves.
pub(crate) fn middle_mean(pixels: &Pixels) -> f64 {
    trimmed_mean(&mut pixels.to_vec(), PIXELS / 8)
}

/// A pixel and those that touch it, row by row.
pub(crate) fn around(pixel: usize) -> impl Iterator<Item = usize> {
    let (row, column) = (pixel / COLUMNS, pixel % COLUMNS);
    let rows = row.saturating_sub(1)..(row + 2).min(ROWS);
    rows.flat_map(move |row| {
        let columns = column.saturating_sub(1)..(column + 2).min(COLUMNS);
        columns.map(move |column| row * COLUMNS + column)
    })
}

/// The pixels that belong to something, in patches of those that touch one another.
pub(crate) fn patches(belongs: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let mut is_open: [bool; PIXELS] = std::array::from_fn(belongs);
    let mut patches = Vec::new();
    for first in 0..PIXELS {
        if !std::mem::take(&mut is_open[first]) {
            continue;
        }
        let mut patch = vec![first];
        let mut next = 0;
        while let Some(&pixel) = patch.get(next) {
            next += 1;
            patch.extend(around(pixel).filter(|near| std::mem::take(&mut is_open[*near])));
        }
        patches.push(patch);
    }
    patches
}

pub(crate) fn two_by_two(pixels: &Pixels) -> Vec<f64> {
    let corners =
        (0..ROWS - 1).flat_map(|row| (0..COLUMNS - 1).map(move |column| row * COLUMNS + column));
    corners
        .map(|at| {
            (pixels[at] + pixels[at + 1] + pixels[at + COLUMNS] + pixels[at + COLUMNS + 1]) / 4.0
        })
        .collect()
}

/// A record with the thermistor at 25 °C.
#[cfg(test)]
pub(crate) fn record(seq: u64, t_boot_ns: u64, pixels: [u16; PIXELS]) -> grideye_recording::Record {
    use grideye_frame::{Reading, ThermistorWord};
    grideye_recording::Record {
        seq,
        stamp: grideye_recording::Stamp {
            t_boot_ns,
            t_utc_ns: 0,
            clock: grideye_recording::ClockState::Synced,
        },
        reading: Reading::Frame(RecordedFrame {
            thermistor: Some(ThermistorWord(400)),
            pixels: pixels.map(PixelWord),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_person_does_not_move_the_middle() {
        let mut pixels = [20.0; PIXELS];
        pixels[10..17].fill(25.0);
        assert_eq!(middle_mean(&pixels), 20.0);
    }
}
