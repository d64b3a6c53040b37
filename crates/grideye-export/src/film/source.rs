//! Frames of one sensor that can be made again at will, so that no format has to hold them all.

use grideye_frame::{COLUMNS, Celsius, ROWS};
use std::time::Duration;

/// Frames of one sensor that can be made again at will.
pub struct Film<'a> {
    /// What they show.
    pub scene: String,
    /// The sensor's name.
    pub sensor: &'a str,
    /// Of their noise.
    pub seed: u64,
    /// Pixels in a row.
    pub columns: usize,
    /// Pixels in a column.
    pub rows: usize,
    /// How many frames.
    pub frames: u32,
    /// Frames a second.
    pub sampling_hz: f64,
    /// What the sensor's thermistor reads.
    pub ambient: Celsius,
    /// When the frame of that number (from 0) was taken, and its pixels: °C, row by row from the top left.
    pub frame: &'a dyn Fn(u32) -> (Duration, Vec<f64>),
}

impl Film<'_> {
    /// Whether a recording can hold its frames.
    #[must_use]
    pub fn is_recording(&self) -> bool {
        (self.columns, self.rows) == (COLUMNS, ROWS)
    }

    /// The temperatures of all pixels of all frames.
    pub(crate) fn celsius(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.frames).flat_map(|index| (self.frame)(index).1)
    }
}

/// What is said behind the number of pictures where not every frame is one.
pub(crate) fn left_out(step: u32, frames: u32) -> String {
    if step > 1 {
        format!(", every {step}. of {frames},")
    } else {
        String::new()
    }
}
