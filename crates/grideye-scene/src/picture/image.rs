//! An image in degrees, and the share of each pixel that an agent fills.

use crate::geometry::count::single;
use grideye_frame::{COLUMNS, Celsius, Frame, ROWS};

/// An image in degrees, row by row: row 0 is the top, column 0 the left as the sensor sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub columns: usize,
    /// Pixels in a column.
    pub rows: usize,
    /// °C, row by row from the top left.
    pub celsius: Vec<f64>,
}

/// The agent's share of each pixel, in the order of [`Image`].
#[derive(Debug, Clone, PartialEq)]
pub struct Mask {
    /// Pixels in a row.
    pub columns: usize,
    /// Pixels in a column.
    pub rows: usize,
    /// Share of the pixel's response (weight of the resampling kernel) on visible parts of the agent, 0 to 1.
    pub share: Vec<f64>,
}

/// What an agent fills of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Filled {
    /// The share of each pixel that shows the agent.
    pub seen: Mask,
    /// The same if nothing else in the room hid the agent.
    pub unhidden: Mask,
}

impl Filled {
    /// The visible share of the agent, 0 to 1; 0 if out of view.
    #[must_use]
    pub fn visibility(&self) -> f64 {
        let whole = self.unhidden.pixels();
        if whole > 0.0 {
            (self.seen.pixels() / whole).min(1.0)
        } else {
            0.0
        }
    }
}

impl Image {
    /// The temperature of one pixel, °C.
    ///
    /// # Panics
    /// If the image has no such pixel.
    #[must_use]
    pub fn at(&self, row: usize, column: usize) -> f64 {
        assert!(
            row < self.rows && column < self.columns,
            "no pixel {row}, {column}"
        );
        self.celsius[row * self.columns + column]
    }

    /// The image as a frame of an 8 x 8 sensor, in the same order; `None` for another size.
    #[must_use]
    pub fn to_frame(&self, thermistor: Celsius) -> Option<Frame> {
        if (self.columns, self.rows) != (COLUMNS, ROWS) {
            return None;
        }
        let mut frame = Frame::uniform(thermistor);
        for (pixel, celsius) in frame.pixels.iter_mut().zip(&self.celsius) {
            *pixel = Celsius::new(single(*celsius));
        }
        Some(frame)
    }
}

impl Mask {
    /// The pixels with an agent's share of at least `share_min`, in the image's order.
    #[must_use]
    pub fn foreground(&self, share_min: f64) -> Vec<bool> {
        self.share
            .iter()
            .map(|share| *share > 0.0 && *share >= share_min)
            .collect()
    }

    /// The sum of all shares: how many pixels the agent fills.
    #[must_use]
    pub fn pixels(&self) -> f64 {
        self.share.iter().sum()
    }
}
