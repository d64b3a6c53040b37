//! Decides whether anyone was there: what moves beyond noise and drift, and what stays warm.
//!
//! It uses means over ten frames and 2 x 2 pixels, less the common mode. A person changes one by a degree or more,
//! noise by six sigmas once in a hundred days, a room's drift by less than [`UNCLAIMED_MIN_C`]. A person
//! who keeps still looks like a heater, so anything that stays warm beyond the pattern of units is reported as neither.

use crate::constants::{MEANS_MIN, MOVED_SIGMAS, UNCLAIMED_MIN_C};
use crate::frames::noise::Histogram;
use crate::frames::types::{Pixels, middle_mean, two_by_two};
use crate::metrics::room_difference::{RoomDifference, Spot};
use crate::numbers::{count, median};
use crate::thresholds::Thresholds;
use grideye_frame::{COLUMNS, PIXELS, ROWS};

/// Values in a mean of 2 x 2 pixels over ten frames.
const VALUES: f64 = 40.0;

/// Whether anyone was there during the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Presence {
    /// Nothing moves and nothing stays warm: an empty room.
    Nobody,
    /// Something comes, goes or moves.
    Somebody(Spot),
    /// Nothing moves, but something stays warm: an object, or a person who keeps still.
    Still(Spot),
    /// Nothing moves, but runs of at least a hundred frames add up to less than half a minute.
    TooShort,
}

/// The place warmest above the room's slope and what the room without people shows there (64 values, °C), if a unit's pattern
/// hardly makes one as warm.
pub(crate) fn stays_warm(mean_c: &Pixels, room_c: Option<&[f64]>) -> Option<Spot> {
    let thresholds = Thresholds::default();
    // Else a room of one temperature, which claims nothing warm.
    let level = middle_mean(mean_c);
    let even = [level; PIXELS];
    let room_c = room_c.unwrap_or(&even);
    let ambient_c = median(room_c).unwrap_or(level);
    RoomDifference::new(mean_c, room_c, ambient_c).beyond_pattern(thresholds.pattern_spread_c)
}

#[derive(Debug)]
pub(crate) struct PresenceFinder {
    squares: Vec<Histogram>,
    sums: Pixels,
    means: usize,
}

impl Default for PresenceFinder {
    fn default() -> Self {
        Self {
            squares: vec![Histogram::default(); (ROWS - 1) * (COLUMNS - 1)],
            sums: [0.0; PIXELS],
            means: 0,
        }
    }
}

impl PresenceFinder {
    /// `reference` is any fixed image of the room.
    pub(crate) fn push(&mut self, mean: &Pixels, reference: &Pixels) {
        let above: Pixels = std::array::from_fn(|pixel| mean[pixel] - reference[pixel]);
        let level = middle_mean(&above);
        let squares = two_by_two(&above.map(|pixel| pixel - level));
        for (histogram, square) in self.squares.iter_mut().zip(squares) {
            histogram.push(square);
        }
        for (sum, pixel) in self.sums.iter_mut().zip(mean) {
            *sum += pixel;
        }
        self.means += 1;
    }

    pub(crate) fn mean_c(&self) -> Option<Pixels> {
        (self.means > 0).then(|| self.sums.map(|sum| sum / count(self.means)))
    }

    pub(crate) fn finish(&self, sigma_c: &Pixels) -> Presence {
        if let Some(spot) = self.moved(sigma_c, UNCLAIMED_MIN_C) {
            return Presence::Somebody(spot);
        }
        let Some(mean_c) = self.mean_c().filter(|_| self.means >= MEANS_MIN) else {
            return Presence::TooShort;
        };
        stays_warm(&mean_c, None).map_or(Presence::Nobody, Presence::Still)
    }

    /// The place that changed most beyond noise and drift.
    fn moved(&self, sigma_c: &Pixels, drift_c: f64) -> Option<Spot> {
        let noise = two_by_two(&sigma_c.map(|sigma| sigma * sigma));
        let spots = self.squares.iter().zip(noise).enumerate();
        spots
            .filter_map(|(place, (square, variance))| {
                let (middle, (low, high)) = (square.quantile(0.5)?, square.extent()?);
                // A person there most of the time shows as a drop on leaving.
                let celsius = (high - middle).max(middle - low);
                let limit = drift_c.max(MOVED_SIGMAS * (variance / VALUES).sqrt());
                (celsius > limit).then_some(Spot {
                    celsius,
                    row: place / (COLUMNS - 1),
                    column: place % (COLUMNS - 1),
                })
            })
            .max_by(|left, right| left.celsius.total_cmp(&right.celsius))
    }
}
