//! What a comparison finds.

use crate::align::Alignment;
use crate::background::fit::BackgroundFit;
use crate::compare::settings::Settings;
use crate::compare::timeline::{FrameScores, PixelMaps};
use crate::frames::Shape;
use crate::metrics::ChiSquared;
use crate::metrics::foreground::{ForegroundCorrelation, RoomSource};
use crate::metrics::score::{Measure, Score, Scores};
use crate::verdict::{Judgement, Nobody, WarmPixels};
use std::time::Duration;

/// Share of pixels below a threshold as a function of that threshold (the paper's evaluation graph), mean over pairs.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationGraph {
    /// The thresholds in degrees.
    pub thresholds_c: Vec<f64>,
    /// Real with simulated, shares of 0 to 1.
    pub simulated: Vec<f64>,
    /// Real with the blank frame.
    pub blank: Vec<f64>,
    /// Real with its own repeat.
    pub repeat: Option<Vec<f64>>,
}

/// A real frame beside the simulated one, for the report.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmFrame {
    /// Time of the real frame since the first of the recording.
    pub time: Duration,
    /// The real frame in degrees.
    pub real: Vec<f64>,
    /// The simulated frame in degrees, with its noise.
    pub simulated: Vec<f64>,
}

/// The outcome of a comparison: scores with their floors and ceilings, and the verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The verdict and its reasons.
    pub judgement: Judgement,
    /// The scores.
    pub scores: Scores,
    /// The evaluation graph.
    pub evaluation: EvaluationGraph,
    /// Frames to show, at most [`crate::FILM_FRAMES_MAX`], in order of time.
    pub film: Vec<FilmFrame>,
    /// Size of the frames.
    pub shape: Shape,
    /// Real frames compared.
    pub real_frames: usize,
    /// Simulated frames compared.
    pub simulated_frames: usize,
    /// Pairs of frames scored.
    pub pairs: usize,
    /// Temporal noise of the sensor in degrees, measured on the repeat; `None` without repeat.
    pub noise_sigma_c: Option<f64>,
    /// A pixel of one frame counts as warm from this far above the background, in degrees.
    pub warm_above_c: f64,
    /// A pixel of the real side belongs to the pixels that the gain is taken over from this far above ambient, in
    /// degrees; one of the claim from half of it. Under the static protocol the mean of the frames is asked.
    pub union_above_c: f64,
    /// How much warmer the recording is than the scene all over, in degrees: median over the pairs of the
    /// mean of the middle half of the pixels' differences.
    pub offset_c: f64,
    /// How far that offset wanders between the pairs, in degrees: largest less smallest.
    pub drift_c: f64,
    /// Trend of that offset in degrees a minute: slope of the least-squares line over the times of the real frames;
    /// `None` where all have one time.
    pub drift_c_per_min: Option<f64>,
    /// What is left between each real frame and the noise-free claim beside it, in units of the sensor's noise, summed
    /// over the real frames.
    pub noise_fit: ChiSquared,
    /// Each real frame beside its simulated one, in order of time.
    pub timeline: Vec<FrameScores>,
    /// The same, pixel by pixel over all frames.
    pub maps: PixelMaps,
    /// Warm pixels.
    pub warm: WarmPixels,
    /// The settings it was made with.
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
