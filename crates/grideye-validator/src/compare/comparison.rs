//! What a comparison finds: over all frames, frame by frame, and pixel by pixel.

use crate::align::Alignment;
use crate::background::fit::BackgroundFit;
use crate::compare::prepared::{ComparedFrames, Prepared, Tally};
use crate::compare::settings::Settings;
use crate::frames::{RealFrame, Shape};
use crate::metrics::foreground::{ForegroundCorrelation, RoomSource};
use crate::metrics::score::{Measure, Score, Scores};
use crate::metrics::{self, ChiSquared, chi_squared, structure_map};
use crate::numbers::mean_frame;
use crate::verdict::{Judgment, Nobody, WarmPixels};
use serde::Serialize;
use std::time::Duration;

/// Share of pixels below a threshold as a function of that threshold (the paper's evaluation graph), mean over pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct EvaluationGraph {
    pub thresholds_c: Vec<f64>,
    /// Real with simulated, shares of 0 to 1.
    pub simulated: Vec<f64>,
    pub blank: Vec<f64>,
    pub repeat: Option<Vec<f64>>,
}

/// A real frame beside the simulated one, for the report.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct FilmFrame {
    /// Time of the real frame since the first of the recording.
    pub time: Duration,
    pub real: Vec<f64>,
    pub simulated: Vec<f64>,
}

/// The outcome of a comparison: scores with their floors and ceilings, and the verdict.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Comparison {
    pub judgment: Judgment,
    pub scores: Scores,
    pub evaluation: EvaluationGraph,
    /// Frames to show, at most [`crate::FILM_FRAMES_MAX`], in order of time.
    pub film: Vec<FilmFrame>,
    pub shape: Shape,
    pub real_frames: usize,
    pub simulated_frames: usize,
    /// Pairs of frames scored.
    pub pairs: usize,
    /// Temporal noise of the sensor in degrees, measured on the repeat; `None` without repeat.
    pub noise_sigma_c: Option<f64>,
    /// A pixel of one frame counts as warm from this far above the background, in degrees.
    pub warm_above_c: f64,
    /// From so far above ambient a real pixel counts for the gain, °C; one of the claim from half of it.
    pub union_above_c: f64,
    /// How much warmer the recording is than the scene all over, °C: median over the pairs.
    pub offset_c: f64,
    /// How far that offset wanders between the pairs, in degrees: largest less smallest.
    pub drift_c: f64,
    /// Trend of that offset, °C a minute; `None` where all frames have one time.
    pub drift_c_per_min: Option<f64>,
    /// Real frames less their noise-free claims, in units of the sensor's noise.
    pub noise_fit: ChiSquared,
    /// Each real frame beside its simulated one, in order of time.
    pub timeline: Vec<FrameScores>,
    /// The same, pixel by pixel over all frames.
    pub maps: PixelMaps,
    pub warm: WarmPixels,
    pub settings: Settings,
    /// What the same scene scores without its people; `None` where there is no scene.
    pub nobody: Option<Nobody>,
    /// C with the empty room taken from both sides; `None` where the scene has no people.
    pub above_room: Option<ForegroundCorrelation>,
    /// The largest common offset that was allowed, °C.
    pub level_max_c: f64,
    /// Standard deviation of the pattern that units were drawn with, root of the mean square over the pixels, °C.
    pub pattern_c: f64,
    /// What leaves so much of it unknown; where it is the scene, nothing is known of this unit.
    pub pattern_from: RoomSource,
    /// How well the profile explains the empty room that the recording shows, where there are both.
    pub background: Option<BackgroundFit>,
    /// What spoils the verdict and can be mended, each a sentence and, on a line of its own, a hint.
    pub warnings: Vec<String>,
    /// What was assumed or left out on the way here, each a sentence.
    pub notes: Vec<String>,
    /// How recording and scene were brought into step, if they were.
    pub alignment: Option<Alignment>,
}

impl Comparison {
    /// The score of one measure.
    #[must_use]
    pub fn score(&self, measure: Measure) -> Score {
        self.scores.get(measure)
    }
}

/// One real frame and the simulated one of equal time (dynamic) or equal number (static).
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
    /// Structural similarity of each pixel's neighborhood, -1 to 1; `None` in frames of less than 3 x 3 pixels.
    pub structure: Option<Vec<f64>>,
}

/// Means over the frames of a timeline, row by row.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
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
