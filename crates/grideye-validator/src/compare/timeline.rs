//! Frame by frame: scores over time, and what each pixel is off by.

use crate::compare::prepared::{ComparedFrames, Prepared, Tally};
use crate::frames::RealFrame;
use crate::metrics;
use crate::metrics::score::Measure;
use crate::metrics::{ChiSquared, chi_squared, structure_map};
use crate::numbers::mean_frame;
use std::time::Duration;

/// One real frame beside its simulated one: the one of equal time under the dynamic protocol, of equal number under the
/// static one.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameScores {
    /// Time of the real frame.
    pub time: Duration,
    /// How much warmer the real frame is all over than the claim, in degrees.
    pub offset_c: f64,
    /// Every measure of a pair; `None` where it is not defined.
    pub values: Vec<(Measure, Option<f64>)>,
    /// Simulated less real, in degrees, row by row.
    pub difference_c: Vec<f64>,
    /// Structural similarity of each pixel's neighbourhood, -1 to 1; `None` in frames of less than 3 x 3 pixels.
    pub structure: Option<Vec<f64>>,
}

/// Means over the frames of a timeline, row by row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PixelMaps {
    /// Mean of simulated less real, in degrees.
    pub bias_c: Vec<f64>,
    /// Root of the mean squared difference, in degrees.
    pub rmse_c: Vec<f64>,
    /// Mean structural similarity, -1 to 1.
    pub structure: Option<Vec<f64>>,
}

impl FrameScores {
    /// One measure of this pair.
    #[must_use]
    pub fn get(&self, measure: Measure) -> Option<f64> {
        self.values
            .iter()
            .find(|(of, _)| *of == measure)
            .and_then(|&(_, value)| value)
    }
}

pub(crate) fn timeline(view: &ComparedFrames, real: &[RealFrame]) -> Vec<FrameScores> {
    let mut tally = Tally::new();
    let scores = |(index, frame): (usize, &RealFrame)| {
        let (now, beside) = (&view.real[index], view.simulated.beside(index)?);
        let mut values = tally.plain(now, beside).to_vec();
        values.extend(view.placed(now, beside, beside));
        let columns = view.preparation.shape.columns;
        let sides = (now.celsius(), beside.celsius());
        Some(FrameScores {
            time: frame.time,
            offset_c: view.offset(index, beside),
            values,
            difference_c: sides.0.iter().zip(sides.1).map(|(x, y)| y - x).collect(),
            structure: structure_map(sides.0, sides.1, columns, view.ambient_c),
        })
    };
    real.iter().enumerate().filter_map(scores).collect()
}

/// Trend of the common offset.
pub(crate) fn drift_c_per_min(timeline: &[FrameScores]) -> Option<f64> {
    let points: Vec<(f64, f64)> = timeline
        .iter()
        .map(|frame| (frame.time.as_secs_f64() / 60.0, frame.offset_c))
        .collect();
    metrics::slope(&points)
}

/// Each real frame counts once, so that the frames are independent.
pub(crate) fn noise_fit(view: &ComparedFrames) -> ChiSquared {
    let of = |(index, frame): (usize, &Prepared)| {
        let claim = view.simulated.beside(index)?.steady();
        chi_squared(frame.celsius(), claim, view.sigma_c)
    };
    let mut sum = ChiSquared::default();
    view.real
        .iter()
        .enumerate()
        .filter_map(of)
        .for_each(|chi| sum.add(chi));
    sum
}

pub(crate) fn maps(timeline: &[FrameScores]) -> PixelMaps {
    let differences = || timeline.iter().map(|frame| frame.difference_c.as_slice());
    let squares: Vec<Vec<f64>> = differences()
        .map(|frame| {
            frame
                .iter()
                .map(|difference| difference * difference)
                .collect()
        })
        .collect();
    let structures: Option<Vec<&[f64]>> = timeline
        .iter()
        .map(|frame| frame.structure.as_deref())
        .collect();
    PixelMaps {
        bias_c: mean_frame(differences()),
        rmse_c: mean_frame(&squares).into_iter().map(f64::sqrt).collect(),
        structure: structures.map(mean_frame),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(seconds: u64, offset_c: f64, difference_c: [f64; 2]) -> FrameScores {
        FrameScores {
            time: Duration::from_secs(seconds),
            offset_c,
            values: Vec::new(),
            difference_c: difference_c.to_vec(),
            structure: None,
        }
    }

    /// Offsets 1, 2, 4 at 0, 30 and 60 seconds: the least-squares slope is 3 degrees a minute.
    #[test]
    fn drift_is_the_slope_a_minute() {
        let frames =
            [(0, 1.0), (30, 2.0), (60, 4.0)].map(|(time, offset)| frame(time, offset, [0.0; 2]));
        assert!((drift_c_per_min(&frames).unwrap() - 3.0).abs() < 1e-12);
        assert_eq!(drift_c_per_min(&frames[..1]), None);
        assert_eq!(drift_c_per_min(&[]), None);
    }

    #[test]
    fn maps_are_means_over_time() {
        let maps = maps(&[frame(0, 0.0, [3.0, -1.0]), frame(1, 0.0, [-4.0, -3.0])]);
        assert_eq!(maps.bias_c, [-0.5, -2.0]);
        assert_eq!(maps.rmse_c, [12.5_f64.sqrt(), 5.0_f64.sqrt()]);
        assert_eq!(maps.structure, None);
    }
}
