//! The slow drift common to all pixels, from those without a person.

use crate::frames::types::Pixels;
use crate::numbers::{common_offset, evenly, extremes, interpolated, median, windowed_mean};

/// Averaging window, seconds: shorter than drift takes, longer than a person stays in one place.
const WINDOW_S: f64 = 20.0;
/// Frames used for each pixel's median level.
const LEVEL_FRAMES: usize = 256;

/// How much warmer than usual the whole image is, over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Drift {
    knots: Vec<(f64, f64)>,
}

impl Drift {
    /// From frames less the claim, at ascending times in seconds; no drift for less than two windows.
    pub(crate) fn new(times_s: &[f64], left: &[Pixels]) -> Self {
        let span_s = times_s.last().unwrap_or(&0.0) - times_s.first().unwrap_or(&0.0);
        if span_s < 2.0 * WINDOW_S {
            return Self::default();
        }
        let level = level(left);
        let left = left.iter();
        let common: Vec<f64> = left.map(|frame| common_offset(frame, &level)).collect();
        let common: Vec<(f64, f64)> = times_s.iter().copied().zip(common).collect();
        let mut knots = windowed_mean(&common, WINDOW_S);
        let all: Vec<f64> = knots.iter().map(|knot| knot.1).collect();
        let middle = median(&all).unwrap_or_default();
        knots.iter_mut().for_each(|knot| knot.1 -= middle);
        Self { knots }
    }

    /// Drift to subtract from a frame at this time, °C.
    pub(crate) fn at(&self, time_s: f64) -> f64 {
        interpolated(&self.knots, time_s)
    }

    pub(crate) fn range_c(&self) -> f64 {
        let all: Vec<f64> = self.knots.iter().map(|knot| knot.1).collect();
        let (low, high) = extremes(&all);
        (high - low).max(0.0)
    }
}

fn level(frames: &[Pixels]) -> Pixels {
    let chosen = evenly(frames.len(), LEVEL_FRAMES);
    std::array::from_fn(|pixel| {
        let values: Vec<f64> = chosen.iter().map(|&index| frames[index][pixel]).collect();
        median(&values).unwrap_or_default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::count;
    use grideye_frame::PIXELS;

    /// A ramp of one degree in a hundred seconds, and a wandering person of 3 degrees on a tenth of the pixels.
    #[test]
    fn a_ramp_is_found_beneath_a_person() {
        let times_s: Vec<f64> = (0..1000_u32).map(|index| f64::from(index) / 10.0).collect();
        let frames: Vec<Pixels> = times_s
            .iter()
            .enumerate()
            .map(|(index, time_s)| {
                let mut frame: Pixels =
                    std::array::from_fn(|pixel| 20.0 + count(pixel % 5) / 10.0 + time_s / 100.0);
                for step in 0..6 {
                    frame[(index / 20 + step) % PIXELS] += 3.0;
                }
                frame
            })
            .collect();
        let drift = Drift::new(&times_s, &frames);
        for time_s in [20.0, 50.0, 80.0] {
            let expected = time_s / 100.0 - 0.5;
            assert!((drift.at(time_s) - expected).abs() < 0.02, "{time_s}");
        }
        // The ends are means over half a window.
        assert!((drift.range_c() - 0.9).abs() < 0.03, "{}", drift.range_c());
    }

    #[test]
    fn a_short_recording_has_no_drift() {
        let times_s = [0.0, 10.0, 39.0];
        let drift = Drift::new(&times_s, &[[20.0; PIXELS], [21.0; PIXELS], [22.0; PIXELS]]);
        assert_eq!((drift.at(10.0), drift.range_c()), (0.0, 0.0));
    }
}
