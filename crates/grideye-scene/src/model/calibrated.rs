//! Which frames a calibration fitted numbers of a scene to, so that a comparison does not judge the scene by them.

use std::collections::BTreeMap;
use std::ops::Range;

/// One calibration: a `[[calibrated]]` table, which `grideye calibrate` writes.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibrated {
    /// The keys that it fitted, as in [`Uncertain::key`](super::uncertain::Uncertain::key).
    pub keys: Vec<String>,
    /// What it left unknown of those that had a normal law: standard deviations around the values in the file, by key.
    pub sd: BTreeMap<String, f64>,
    /// Every frame it was fitted to is at most this far from one of `frames`, in seconds of the recording.
    pub every_s: f64,
    /// Marks of frames' pixels, evenly over the fitted stretch.
    pub frames: Vec<u32>,
    /// The table's lines in the text, header included; empty if it has no header of its own.
    pub lines: Range<usize>,
}
