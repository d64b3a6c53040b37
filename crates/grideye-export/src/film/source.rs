//! A film: frames of one sensor that are computed on demand, so that no format holds them all.

use grideye_frame::{COLUMNS, Celsius, ROWS};
use std::time::Duration;

/// Frames of one sensor, computed on demand.
pub struct Film<'a> {
    /// What the frames show.
    pub scene: String,
    /// The sensor's name.
    pub sensor: &'a str,
    /// Seed of the noise.
    pub seed: u64,
    /// Pixels in a row.
    pub columns: usize,
    /// Pixels in a column.
    pub rows: usize,
    /// Number of frames.
    pub frames: u32,
    /// Frames per second.
    pub sampling_hz: f64,
    /// The scene's start on the wall clock, in nanoseconds since 1970-01-01 UTC; `None` if the scene does not know it.
    pub starts_utc_ns: Option<i64>,
    /// The thermistor's reading.
    pub ambient: Celsius,
    /// Time and pixels of the frame with this number (from 0): °C, row by row from the top left.
    pub frame: &'a dyn Fn(u32) -> (Duration, Vec<f64>),
}

impl Film<'_> {
    /// Whether a recording can hold the frames.
    #[must_use]
    pub fn is_recording(&self) -> bool {
        (self.columns, self.rows) == (COLUMNS, ROWS)
    }

    pub(crate) fn celsius(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.frames).flat_map(|index| (self.frame)(index).1)
    }
}

/// The note on skipped frames, for the description of the result.
pub(crate) fn left_out(step: u32, frames: u32) -> String {
    if step > 1 {
        format!(", every {step}. of {frames},")
    } else {
        String::new()
    }
}
