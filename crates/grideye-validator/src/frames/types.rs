//! Frames of either side, their size, and which of them meet.

use std::time::Duration;

/// Which real frame meets which simulated one (PeerJ CS 11:e3124, "Experiments and results").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// Nothing moves: every real frame with every simulated one, averaged.
    Static,
    /// Something moves: frame by frame, at equal times.
    Dynamic,
}

impl Protocol {
    /// The stable name: `static` or `dynamic`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Dynamic => "dynamic",
        }
    }
}

/// Size of a frame in pixels. Frames are row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Pixels in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
}

impl Shape {
    /// Pixels of a frame.
    #[must_use]
    pub const fn pixels(self) -> usize {
        self.columns.saturating_mul(self.rows)
    }
}

/// A frame of the sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct RealFrame {
    /// Time since the first frame of the recording.
    pub time: Duration,
    /// Temperatures in degrees, row by row.
    pub celsius: Vec<f64>,
    /// The sensor's frame `lag_frames` later, if the recording has it: the ceiling is made of these.
    pub later: Option<Vec<f64>>,
}

/// A frame of the simulator.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedFrame {
    /// Time since the start of the scene.
    pub time: Duration,
    /// Temperatures in degrees, row by row, with the sensor's noise.
    pub celsius: Vec<f64>,
    /// The same without noise: which pixels the scene claims to be warm is read from it.
    pub noise_free: Vec<f64>,
    /// The pixels that the scene's agents cover for the greater part, if that is known.
    pub truth: Option<Vec<bool>>,
}
