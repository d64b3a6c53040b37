//! How many frames a segment has, how fine the histograms of differences are, and how few frames are too few.

/// The fewest frames from which anything is said.
pub const FRAMES_MIN: u64 = 50;
/// Bins of the histograms of differences are this wide, °C: fine against the sensor's step of 0.25.
pub(crate) const DIFFERENCE_BIN_C: f64 = 1.0 / 64.0;
/// Frames of a segment: ten seconds at full rate.
pub(crate) const SEGMENT_FRAMES: usize = 100;
