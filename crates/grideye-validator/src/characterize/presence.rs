//! Whether somebody was there: what moves beyond noise and drift, and what stands there warm.
//!
//! Looked at are means over ten frames and two by two pixels, less what all pixels do together. Somebody changes one by a degree
//! or more, noise by six of its deviations once in a hundred days, a room's drift by less than [`Thresholds::unclaimed_min_c`].
//! Who keeps still is no different from a heater: what stays warm beyond the pattern of units is taken for neither.

use crate::characterize::histogram::Histogram;
use crate::frames::types::{Pixels, middle_mean, two_by_two};
use crate::metrics::gain::WarmLimits;
use crate::metrics::unclaimed::RoomDifference;
use crate::numbers::count;
use crate::thresholds::Thresholds;
use grideye_frame::{COLUMNS, PIXELS, ROWS};

/// Means below which nobody's absence is known, half a minute (LINAIGE: somebody moves 0.65 °C or more in as long).
const MEANS_MIN: usize = 30;
/// So many standard deviations are no noise.
const MOVED_SIGMAS: f64 = 6.0;
/// Two by two pixels over ten frames have the noise of one value over the root of so many.
const VALUES: f64 = 40.0;

/// Whether somebody was there while it was recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Presence {
    /// Nothing moves, and nothing warm stands there: the recording is of an empty room.
    Nobody,
    /// Something comes, goes or moves.
    Somebody(Spot),
    /// Nothing moves, but something warm stands there: an object, or somebody who keeps still.
    Still(Spot),
    /// Less than half a minute in stretches of a hundred frames or more, in which nothing moves.
    TooShort,
}

/// Two by two pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// How far their mean changes, or stands out, °C.
    pub celsius: f64,
    /// Row of the upper ones, counted from 0.
    pub row: usize,
    /// Column of the left ones, counted from 0.
    pub column: usize,
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
        let thresholds = Thresholds::default();
        if let Some(spot) = self.moved(sigma_c, thresholds.unclaimed_min_c) {
            return Presence::Somebody(spot);
        }
        let Some(mean_c) = self.mean_c().filter(|_| self.means >= MEANS_MIN) else {
            return Presence::TooShort;
        };
        // Beside a room of one temperature, nothing is claimed to be warm.
        let level = middle_mean(&mean_c);
        let warmth = WarmLimits::new(level, thresholds.unclaimed_min_c);
        RoomDifference::new(&mean_c, &[level; PIXELS], COLUMNS, warmth)
            .beyond_pattern(thresholds.pattern_spread_c)
            .map_or(Presence::Nobody, |block| {
                Presence::Still(Spot {
                    celsius: block.celsius,
                    row: block.row,
                    column: block.column,
                })
            })
    }

    /// The two by two pixels that changed most beyond what noise and drift do.
    fn moved(&self, sigma_c: &Pixels, drift_c: f64) -> Option<Spot> {
        let noise = two_by_two(&sigma_c.map(|sigma| sigma * sigma));
        let spots = self.squares.iter().zip(noise).enumerate();
        spots
            .filter_map(|(place, (square, variance))| {
                let (middle, (low, high)) = (square.quantile(0.5)?, square.extent()?);
                // Who was there for most of the time left, and that is a change downwards.
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
