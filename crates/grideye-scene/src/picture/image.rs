//! A picture in degrees, and the share of each pixel that an agent fills.

use crate::geometry::count::single;
use grideye_frame::{COLUMNS, Celsius, Frame, ROWS};

/// A picture in degrees, row by row: row 0 is the top, column 0 the left of what the sensor sees.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub columns: usize,
    /// Pixels in a column.
    pub rows: usize,
    /// °C, row by row from the top left.
    pub celsius: Vec<f64>,
}

/// How much of each pixel is an agent, laid out as the [`Image`] is.
#[derive(Debug, Clone, PartialEq)]
pub struct Mask {
    /// Pixels in a row.
    pub columns: usize,
    /// Pixels in a column.
    pub rows: usize,
    /// Share of the pixel's response (weight of the resampling kernel) that falls on a visible part of it, 0 to 1.
    pub share: Vec<f64>,
}

impl Image {
    /// The temperature of one pixel, °C.
    ///
    /// # Panics
    /// If the picture has no such pixel.
    #[must_use]
    pub fn at(&self, row: usize, column: usize) -> f64 {
        assert!(
            row < self.rows && column < self.columns,
            "no pixel {row}, {column}"
        );
        self.celsius[row * self.columns + column]
    }

    /// The picture as a frame of an 8 x 8 sensor, in the same order; `None` if it has another size.
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
    /// The pixels of which at least `share_min` is the agent, in the picture's order.
    #[must_use]
    pub fn foreground(&self, share_min: f64) -> Vec<bool> {
        self.share
            .iter()
            .map(|share| *share > 0.0 && *share >= share_min)
            .collect()
    }
}
