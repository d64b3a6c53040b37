//! The warm blob of a frame.

use crate::numbers::{all_finite, count, median};

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
    /// The blob of a frame with `columns` pixels per row; `None` if nothing is `above_c` °C above the frame's median.
    #[must_use]
    pub fn find(frame: &[f64], columns: usize, above_c: f64) -> Option<Self> {
        Self::above(frame, columns, (median(frame)?, above_c))
    }

    /// [`Blob::find`] against a known background, °C.
    pub(crate) fn above(
        frame: &[f64],
        columns: usize,
        (background, above_c): (f64, f64),
    ) -> Option<Self> {
        if columns == 0 || frame.len() % columns != 0 || !all_finite(frame) {
            return None;
        }
        let is_warm = |value: &f64| value - background > above_c;
        let mut left: Vec<bool> = frame.iter().map(is_warm).collect();
        let mut largest: Option<(f64, Self)> = None;
        while let Some(seed) = left.iter().position(|&warm| warm) {
            let (warmth, blob) = patch(frame, columns, background, seed, &mut left);
            if largest.is_none_or(|(most, _)| warmth > most) {
                largest = Some((warmth, blob));
            }
        }
        largest.map(|(_, blob)| blob)
    }

    /// Distance between the centroids, pixels.
    #[must_use]
    pub fn distance_pixels(&self, other: &Self) -> f64 {
        (self.column - other.column).hypot(self.row - other.row)
    }
}

fn patch(
    frame: &[f64],
    columns: usize,
    background: f64,
    seed: usize,
    left: &mut [bool],
) -> (f64, Blob) {
    let rows = frame.len() / columns;
    let (mut warmth, mut column_sum, mut row_sum, mut pixels) = (0.0, 0.0, 0.0, 0);
    let mut open = vec![seed];
    left[seed] = false;
    while let Some(pixel) = open.pop() {
        let (row, column) = (pixel / columns, pixel % columns);
        let excess = frame[pixel] - background;
        warmth += excess;
        column_sum += excess * count(column);
        row_sum += excess * count(row);
        pixels += 1;
        for row in row.saturating_sub(1)..=(row + 1).min(rows - 1) {
            for column in column.saturating_sub(1)..=(column + 1).min(columns - 1) {
                let neighbor = row * columns + column;
                if std::mem::take(&mut left[neighbor]) {
                    open.push(neighbor);
                }
            }
        }
    }
    let blob = Blob {
        column: column_sum / warmth,
        row: row_sum / warmth,
        pixels,
    };
    (warmth, blob)
}
