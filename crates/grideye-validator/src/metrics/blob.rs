//! The warm blob of a frame.

use crate::frames::types::{Pixels, patches};
use crate::numbers::{all_finite, count, median};
use grideye_frame::COLUMNS;

/// The patch of touching warm pixels with the most warmth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blob {
    /// Column of the centroid, weighted by warmth above the median, pixels from the center of the first column.
    pub column: f64,
    /// Row of the centroid, pixels from the center of the first row.
    pub row: f64,
    /// Number of pixels.
    pub pixels: usize,
}

impl Blob {
    /// The blob of a frame (64 values, °C); `None` if nothing is `above_c` °C above the frame's median.
    #[must_use]
    pub fn find(frame: &[f64; 64], above_c: f64) -> Option<Self> {
        Self::above(frame, (median(frame)?, above_c))
    }

    /// [`Blob::find`] against a known background, °C.
    pub(crate) fn above(frame: &Pixels, (background, above_c): (f64, f64)) -> Option<Self> {
        if !all_finite(frame) {
            return None;
        }
        let patches = patches(|pixel| frame[pixel] - background > above_c);
        // Of several as warm, the first.
        let blobs = patches.iter().rev().map(|patch| {
            let weighted = |of: &dyn Fn(usize) -> f64| -> f64 {
                let terms = patch
                    .iter()
                    .map(|&pixel| (frame[pixel] - background) * of(pixel));
                terms.sum()
            };
            let warmth = weighted(&|_| 1.0);
            let blob = Self {
                column: weighted(&|pixel| count(pixel % COLUMNS)) / warmth,
                row: weighted(&|pixel| count(pixel / COLUMNS)) / warmth,
                pixels: patch.len(),
            };
            (warmth, blob)
        });
        let largest = blobs.max_by(|one, other| one.0.total_cmp(&other.0));
        largest.map(|(_, blob)| blob)
    }

    /// Distance between the centroids, pixels.
    #[must_use]
    pub fn distance_pixels(&self, other: &Self) -> f64 {
        (self.column - other.column).hypot(self.row - other.row)
    }
}
