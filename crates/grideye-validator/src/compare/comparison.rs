//! The result of a comparison: over all frames, frame by frame, and pixel by pixel.

use crate::align::Alignment;
use crate::background::fit::BackgroundFit;
use crate::compare::prepared::{ComparedFrames, Prepared, Tally};
use crate::compare::settings::Settings;
use crate::decision::Decision;
use crate::frames::{RealFrame, Shape};
use crate::metrics::foreground::{ForegroundCorrelation, RoomSource};
use crate::metrics::score::{Measure, Score, Scores};
use crate::metrics::{self, ChiSquared, chi_squared, structure_map};
use crate::numbers::mean_frame;
use crate::verdict::{Judgment, Nobody, WarmPixels};
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
    pub shape: Shape,
    pub real_frames: usize,
    pub simulated_frames: usize,
    /// Pairs of frames scored.
    pub pairs: usize,
    /// Temporal noise of the sensor measured on the repeat, °C; `None` without repeat.
    pub noise_sigma_c: Option<f64>,
    /// A pixel is warm from this much above its frame's background, °C.
    pub warm_above_c: f64,
    /// A real pixel counts for the gain from this much above ambient, °C; a claimed one from half of it.
    pub union_above_c: f64,
    /// How much warmer the recording is than the scene overall, °C: median over the pairs.
    pub offset_c: f64,
    /// Range of that offset over the pairs, °C.
    pub drift_c: f64,
    /// Trend of that offset, °C per minute; `None` if all frames have the same time.
    pub drift_c_per_min: Option<f64>,
    /// Chi squared of the real frames against their noise-free claims.
    pub noise_fit: ChiSquared,
    /// Each real frame with its simulated one, in order of time.
    pub timeline: Vec<FrameScores>,
    /// Means per pixel over all frames.
    pub maps: PixelMaps,
    pub warm: WarmPixels,
    pub settings: Settings,
    /// Scores of the scene without its people; `None` without a scene.
    pub nobody: Option<Nobody>,
    /// C with the empty room subtracted from both sides; `None` if the scene has no people.
    pub above_room: Option<ForegroundCorrelation>,
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
    pub fn score(&self, measure: Measure) -> Score {
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
    /// Every measure of the pair; `None` where undefined.
    pub values: Vec<(Measure, Option<f64>)>,
    /// Simulated less real, °C, row by row.
    pub difference_c: Vec<f64>,
    /// Structural similarity of each pixel's neighborhood, -1 to 1; `None` below 3 x 3 pixels.
    pub structure: Option<Vec<f64>>,
}

/// Means over the timeline, row by row.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PixelMaps {
    /// Mean of simulated less real, °C.
    pub bias_c: Vec<f64>,
    /// RMS difference, °C.
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
        let sides = (&now.celsius, &beside.celsius);
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
        let claim = view.simulated.beside(index)?;
        chi_squared(&frame.celsius, &claim.steady, view.sigma_c)
    };
    view.real.iter().enumerate().filter_map(of).sum()
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

    /// Offsets 1, 2, 4 at 0, 30 and 60 seconds: the least-squares slope is 3 degrees per minute.
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
