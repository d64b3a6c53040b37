//! Where people are in a frame: the warmest places, each with the pixels around it.

use crate::background::{WARM_C, mask};
use grideye_frame::{COLUMNS, PIXELS, ROWS};

/// The most places that are told.
pub const PLACES_MAX: usize = 8;
/// Two places are at least this far apart, in pixels.
const APART: f32 = 2.0;
/// A pixel belongs to the nearest place within this distance, in pixels.
const REACH: f32 = 2.5;

/// Where a person is, in pixels: (0, 0) is the middle of pixel 1, x grows along a row.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Place {
    /// Column.
    pub x: f32,
    /// Row.
    pub y: f32,
    /// Excess over the empty room, °C.
    pub excess_c: f32,
}

impl Place {
    pub(crate) fn distance(&self, x: f32, y: f32) -> f32 {
        libm::hypotf(self.x - x, self.y - y)
    }
}

/// Up to [`PLACES_MAX`] places, the warmest first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Places {
    all: [Place; PLACES_MAX],
    count: usize,
}

impl Places {
    /// As a slice.
    #[must_use]
    pub fn as_slice(&self) -> &[Place] {
        &self.all[..self.count]
    }

    /// The warmest places of a frame, at most `most`.
    pub(crate) fn of(excess: &[f32; PIXELS], most: usize) -> Self {
        let smooth = smoothed(excess);
        let mut places = Self::default();
        let mut left = mask(|pixel| excess[pixel] >= WARM_C / 2.0);
        while places.count < most.min(PLACES_MAX) && left != 0 {
            let among = (0..PIXELS).filter(|pixel| left >> pixel & 1 == 1);
            let Some(peak) = among.max_by(|one, other| smooth[*one].total_cmp(&smooth[*other]))
            else {
                break;
            };
            let place = centroid(excess, peak);
            places.all[places.count] = place;
            places.count += 1;
            left &= !mask(|pixel| {
                let (x, y) = middle(pixel);
                place.distance(x, y) < APART
            });
            left &= !(1 << peak);
        }
        places
    }

    /// The warm pixels of these places.
    pub(crate) fn pixels(&self, excess: &[f32; PIXELS]) -> u64 {
        mask(|pixel| {
            let (x, y) = middle(pixel);
            excess[pixel] >= WARM_C / 2.0
                && self
                    .as_slice()
                    .iter()
                    .any(|place| place.distance(x, y) <= REACH)
        })
    }
}

fn middle(pixel: usize) -> (f32, f32) {
    // Below 8, so exact.
    let small = |index: usize| u8::try_from(index).map_or(0.0, f32::from);
    (small(pixel % COLUMNS), small(pixel / COLUMNS))
}

/// The pixels beside a pixel and itself, with their weights of 1, 2 and 4.
fn around(pixel: usize) -> impl Iterator<Item = (usize, f32)> {
    let (row, column) = (pixel / COLUMNS, pixel % COLUMNS);
    let steps = [(0_usize, 1.0_f32), (1, 2.0), (2, 1.0)];
    steps.into_iter().flat_map(move |(down, high)| {
        steps.into_iter().filter_map(move |(right, wide)| {
            let row = (row + down).checked_sub(1).filter(|row| *row < ROWS)?;
            let column = (column + right)
                .checked_sub(1)
                .filter(|column| *column < COLUMNS)?;
            Some((row * COLUMNS + column, high * wide))
        })
    })
}

fn smoothed(excess: &[f32; PIXELS]) -> [f32; PIXELS] {
    core::array::from_fn(|pixel| {
        around(pixel)
            .map(|(beside, weight)| weight * excess[beside])
            .sum()
    })
}

/// The middle of the warmth around a pixel.
fn centroid(excess: &[f32; PIXELS], peak: usize) -> Place {
    let (mut sum, mut x_sum, mut y_sum) = (0.0, 0.0, 0.0);
    for (pixel, _) in around(peak) {
        let (x, y) = middle(pixel);
        let warmth = excess[pixel].max(0.0);
        sum += warmth;
        x_sum += warmth * x;
        y_sum += warmth * y;
    }
    let (x, y) = if sum > 0.0 {
        (x_sum / sum, y_sum / sum)
    } else {
        middle(peak)
    };
    Place {
        x,
        y,
        excess_c: excess[peak],
    }
}
