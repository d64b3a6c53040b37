//! The warm blob of a frame: warm pixels, the largest patch of them, and the overlap of two frames.

use crate::numbers::{all_finite, count, finite, median};

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

/// Pixels more than `above_c` °C above the frame's median; none if the frame is not finite.
#[must_use]
pub fn warm(frame: &[f64], above_c: f64) -> Vec<bool> {
    let background = median(frame).filter(|_| all_finite(frame));
    let is_warm = |&value: &f64| background.is_some_and(|background| value - background > above_c);
    frame.iter().map(is_warm).collect()
}

impl Blob {
    /// The blob of a frame with `columns` pixels per row; `None` if nothing is `above_c` °C above the frame's median.
    #[must_use]
    pub fn find(frame: &[f64], columns: usize, above_c: f64) -> Option<Self> {
        if columns == 0 || frame.len() % columns != 0 {
            return None;
        }
        Self::of(frame, columns, median(frame)?, &warm(frame, above_c))
    }

    /// The blob of pixels known to be warm against a background.
    pub(crate) fn of(
        frame: &[f64],
        columns: usize,
        background: f64,
        warm: &[bool],
    ) -> Option<Self> {
        let mut left = warm.to_vec();
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

/// Angle between two centroids as a sensor of this shape sees them, degrees; `field_of_view_rad` are full angles.
#[must_use]
pub fn angle_between(
    one: &Blob,
    other: &Blob,
    (columns, rows): (usize, usize),
    field_of_view_rad: [f64; 2],
) -> Option<f64> {
    let direction = |blob: &Blob| {
        let along = |place: f64, pixels: usize, angle: f64| {
            let half = count(pixels) / 2.0;
            (place + 0.5 - half) / half * (angle / 2.0).tan()
        };
        [
            along(blob.column, columns, field_of_view_rad[0]),
            along(blob.row, rows, field_of_view_rad[1]),
            1.0,
        ]
    };
    let (a, b) = (direction(one), direction(other));
    let cross = [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ];
    let length = cross.iter().map(|value| value * value).sum::<f64>().sqrt();
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    // The arc cosine has no precision for small angles.
    finite(length.atan2(dot).to_degrees())
}

/// Intersection over union of two masks, 0 to 1 (Jaccard's index); `None` if both are empty.
#[must_use]
pub fn overlap(one: &[bool], other: &[bool]) -> Option<f64> {
    let both = one.iter().zip(other).filter(|(a, b)| **a && **b).count();
    let either = one.iter().zip(other).filter(|(a, b)| **a || **b).count();
    (either > 0 && one.len() == other.len()).then(|| count(both) / count(either))
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
