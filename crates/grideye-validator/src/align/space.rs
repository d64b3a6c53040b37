//! The orientation and subpixel offset of an image.

use crate::align::series::{FitSums, Sample, Series};
use crate::frames::types::Pixels;
use crate::metrics::correlation;
use crate::names::named;
use crate::numbers::{climb, count, index};
use grideye_frame::COLUMNS;

named! {
    /// Orientation of the recorded image against the scene's; the words complete "the image is".
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
    #[expect(missing_docs, reason = "the names say it")]
    pub enum Orientation {
        #[default]
        Upright = "upright", "upright";
        QuarterClockwise = "quarter_clockwise", "turned a quarter clockwise";
        Half = "half", "turned by half";
        QuarterCounterclockwise = "quarter_counterclockwise", "turned a quarter counter-clockwise";
        MirroredLeftRight = "mirrored_left_right", "mirrored left to right";
        MirroredTopBottom = "mirrored_top_bottom", "mirrored top to bottom";
        Transposed = "transposed", "transposed (rows and columns swapped)";
        TransposedOther = "transposed_other", "transposed about the other diagonal";
    }
}

impl Orientation {
    /// Whether it is a mirror image, which no mounting of a sensor makes.
    #[must_use]
    pub const fn is_mirrored(self) -> bool {
        use Orientation::{Half, QuarterClockwise, QuarterCounterclockwise, Upright};
        !matches!(
            self,
            Upright | QuarterClockwise | Half | QuarterCounterclockwise
        )
    }

    /// The orientation that undoes this one.
    #[must_use]
    pub const fn inverse(self) -> Self {
        match self {
            Self::QuarterClockwise => Self::QuarterCounterclockwise,
            Self::QuarterCounterclockwise => Self::QuarterClockwise,
            other => other,
        }
    }

    /// An upright image (64 values, row by row) as seen in this orientation.
    #[must_use]
    pub fn apply<T: Copy>(self, upright: &[T; 64]) -> [T; 64] {
        std::array::from_fn(|index| upright[self.source(index)])
    }

    const fn source(self, index: usize) -> usize {
        let (row, column) = (index / COLUMNS, index % COLUMNS);
        let last = COLUMNS - 1;
        let (row, column) = match self {
            Self::Upright => (row, column),
            Self::QuarterClockwise => (last - column, row),
            Self::Half => (last - row, last - column),
            Self::QuarterCounterclockwise => (column, last - row),
            Self::MirroredLeftRight => (row, last - column),
            Self::MirroredTopBottom => (last - row, column),
            Self::Transposed => (column, row),
            Self::TransposedOther => (last - column, last - row),
        };
        row * COLUMNS + column
    }
}

/// An image moved right and down by parts of a pixel; the edge is repeated.
pub(crate) fn moved(image: &Pixels, right_px: f64, down_px: f64) -> Pixels {
    let columns = i32::try_from(COLUMNS).unwrap_or(i32::MAX);
    let at = |row: f64, column: f64| {
        let last = f64::from(columns - 1);
        let (row, column) = (row.clamp(0.0, last), column.clamp(0.0, last));
        image[index(row) * COLUMNS + index(column)]
    };
    std::array::from_fn(|index| {
        let row = count(index / COLUMNS) - down_px;
        let column = count(index % COLUMNS) - right_px;
        let (top, left) = (row.floor(), column.floor());
        let (down, right) = (row - top, column - left);
        (1.0 - down) * ((1.0 - right) * at(top, left) + right * at(top, left + 1.0))
            + down * ((1.0 - right) * at(top + 1.0, left) + right * at(top + 1.0, left + 1.0))
    })
}

pub(crate) struct Pairs(Vec<(Pixels, Pixels)>, f64);

impl Pairs {
    pub(crate) fn moving(sample: &Sample, series: &Series, scene_s: impl Fn(f64) -> f64) -> Self {
        let pair = |(&time_s, real): (&f64, &Pixels)| (*real, series.at(scene_s(time_s)));
        let frames = sample.times_s.iter().zip(&sample.frames);
        Self(frames.map(pair).collect(), sample.energy)
    }

    fn likeness(&self, right_px: f64, down_px: f64) -> f64 {
        let mut sums = FitSums::default();
        for (real, claim) in &self.0 {
            sums.add(real, &moved(claim, right_px, down_px));
        }
        sums.fit(self.1).likeness
    }

    /// Best offset of the recorded image, pixels right and down, up to `most` each way; likeness without and with it.
    pub(crate) fn best_offset(&self, most: f64) -> ([f64; 2], [f64; 2]) {
        let without = self.likeness(0.0, 0.0);
        let likeness = |place: &[f64; 2]| self.likeness(place[0], place[1]);
        let neighbors = |best: &[f64; 2], step: f64| {
            [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]].map(|[right, down]: [f64; 2]| {
                [best[0] + right * step, best[1] + down * step].map(|px| px.clamp(-most, most))
            })
        };
        let (value, best) = climb([0.0, 0.0], (0.5, 0.005), likeness, neighbors);
        (best, [without, value])
    }
}

/// Correlation of two still images; 0 if one has no contrast.
pub(crate) fn still_likeness(real: &Pixels, claim: &Pixels) -> f64 {
    correlation(real, claim).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_moved_by_a_part_of_a_pixel_falls_by_that_part() {
        let ramp: Pixels = std::array::from_fn(|index| count(index % COLUMNS));
        let right = moved(&ramp, 0.3, 0.0);
        for (index, (moved, was)) in right.iter().zip(&ramp).enumerate() {
            let expected = if index % COLUMNS == 0 { 0.0 } else { was - 0.3 };
            assert!((moved - expected).abs() < 1e-12, "{index}: {moved}");
        }
        let down = moved(&Orientation::Transposed.apply(&ramp), 0.0, -0.25);
        assert!((down[8] - 1.25).abs() < 1e-12 && (down[60] - 7.0).abs() < 1e-12);
    }
}
