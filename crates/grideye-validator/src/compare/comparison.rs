//! The result of a comparison: over all frames, frame by frame, and pixel by pixel.

use crate::align::Alignment;
use crate::background::fit::BackgroundFit;
use crate::compare::prepared::ComparedFrames;
use crate::compare::settings::Settings;
use crate::compare::sums::Sums;
use crate::decision::Decision;
use crate::frames::{RealFrame, RoomSource};
use crate::metrics::score::{Measure, Score, Scores, Values};
use crate::numbers::{common_offset, differences, mean_frame};
use crate::verdict::Judgment;
use serde::Serialize;
use std::time::Duration;

/// The paper's evaluation graph: share of pixels that differ by less than each threshold, mean over pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct EvaluationGraph {
    pub thresholds_c: Vec<f64>,
    /// Real against simulated frames, shares of 0 to 1.
    pub simulated: Vec<f64>,
    pub blank: Vec<f64>,
    pub repeat: Option<Vec<f64>>,
}

/// A real frame and its simulated one, for the report.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct FilmFrame {
    /// Time of the real frame since the recording's first.
    pub time: Duration,
    /// Time of the simulated one since the start of the scene.
    pub scene_time: Duration,
    pub real: Vec<f64>,
    pub simulated: Vec<f64>,
}

/// The result of a comparison: scores with floors and ceilings, and the verdict.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Comparison {
    pub judgment: Judgment,
    /// What the judgment rests on; `None` without a scene.
    pub decision: Option<Decision>,
    pub scores: Scores,
    pub evaluation: EvaluationGraph,
    /// Frames to show, at most [`crate::FILM_FRAMES_MAX`], in order of time.
    pub film: Vec<FilmFrame>,
    pub real_frames: usize,
    pub simulated_frames: usize,
    /// Pairs of frames scored.
    pub pairs: usize,
    /// Temporal noise of the sensor measured on the repeat, °C; `None` without repeat.
    pub noise_sigma_c: Option<f64>,
    /// A pixel is warm from this much above its frame's background, °C.
    pub warm_above_c: f64,
    /// How much warmer the recording is than the scene overall, °C: median over the frames.
    pub offset_c: f64,
    /// Range of that offset over the frames, °C.
    pub drift_c: f64,
    /// Each real frame with its simulated one, in order of time.
    pub timeline: Vec<FrameScores>,
    /// Means per pixel over all frames.
    pub maps: PixelMaps,
    pub settings: Settings,
    /// The largest common offset allowed, °C.
    pub level_max_c: f64,
    /// RMS over the pixels of the pattern that the units were drawn with, °C.
    pub pattern_c: f64,
    /// Source of the known pattern; for [`RoomSource::Scene`] nothing is known of this unit.
    pub pattern_from: RoomSource,
    /// How well the profile explains the recording's empty room, if there are both.
    pub background: Option<BackgroundFit>,
    /// Correctable problems that weaken the verdict: a sentence each, with a hint on its own line.
    pub warnings: Vec<String>,
    /// Assumptions and omissions, a sentence each.
    pub notes: Vec<String>,
    /// How recording and scene were aligned, if they were.
    pub alignment: Option<Alignment>,
}

impl Comparison {
    /// The score of one measure.
    #[must_use]
    pub const fn score(&self, measure: Measure) -> Score {
        self.scores.get(measure)
    }
}

/// Scores of a real frame and the simulated one at the same time (dynamic) or index (static).
#[derive(Debug, Clone, PartialEq)]
pub struct FrameScores {
    /// Time of the real frame.
    pub time: Duration,
    /// How much warmer the real frame is than the claim overall, °C.
    pub offset_c: f64,
    /// Every measure of the pair.
    pub values: Values,
    /// Real minus simulated, °C, row by row.
    pub difference_c: Vec<f64>,
}

/// Means over the timeline, row by row.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PixelMaps {
    /// Mean of real minus simulated, °C.
    pub bias_c: Vec<f64>,
    /// RMS difference, °C.
    pub rmse_c: Vec<f64>,
}

impl FrameScores {
    /// One measure of this pair.
    #[must_use]
    pub const fn get(&self, measure: Measure) -> Option<f64> {
        self.values[measure.place()]
    }
}

pub(crate) fn timeline(view: &ComparedFrames, real: &[RealFrame]) -> Vec<FrameScores> {
    let mut sums = Sums::default();
    let mut scores = |(index, frame): (usize, &RealFrame)| {
        let now = &view.real[index];
        // Under the static protocol there may be fewer simulated frames.
        let beside = view.simulated.get(index).or(view.simulated.last())?;
        Some(FrameScores {
            time: frame.time,
            offset_c: common_offset(&now.celsius, &beside.shown),
            values: sums.pair(now, beside),
            difference_c: differences(&beside.celsius, &now.celsius).collect(),
        })
    };
    let frames = real.iter().enumerate();
    frames.filter_map(&mut scores).collect()
}

pub(crate) fn maps(timeline: &[FrameScores]) -> PixelMaps {
    let differences = || timeline.iter().map(|frame| frame.difference_c.as_slice());
    let squares = |frame: &[f64]| -> Vec<f64> { frame.iter().map(|pixel| pixel * pixel).collect() };
    let squares = mean_frame(differences().map(squares));
    PixelMaps {
        bias_c: mean_frame(differences()),
        rmse_c: squares.into_iter().map(f64::sqrt).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_means_over_time() {
        let frame = |difference_c: [f64; 2]| FrameScores {
            time: Duration::ZERO,
            offset_c: 0.0,
            values: Values::default(),
            difference_c: difference_c.to_vec(),
        };
        let maps = maps(&[frame([3.0, -1.0]), frame([-4.0, -3.0])]);
        assert_eq!(maps.bias_c, [-0.5, -2.0]);
        assert_eq!(maps.rmse_c, [12.5_f64.sqrt(), 5.0_f64.sqrt()]);
    }
}
