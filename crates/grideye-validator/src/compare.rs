mod bootstrap;
mod checks;
mod floors;
mod outcome;
mod sums;
mod thin;
mod timeline;

pub use outcome::{Comparison, EvaluationGraph, FilmFrame};
pub use thin::{RECORDS_MAX, RUN_RECORDS, Thinned, Thinning};
pub use timeline::{FrameScores, PixelMaps};

use crate::error::ValidatorError;
use crate::frames::{Making, Prepared, SceneView, Side, median};
use crate::metrics::{self, Binning, count};
use crate::score::{Measure, Score, Scores};
use crate::union::Union;
use crate::verdict::{
    AboveRoom, Beside, Evidence, Nobody, Thresholds, WarmPixels, above_room, judge,
};
use bootstrap::{Bootstrap, mean_square, pattern_c};
use floors::{blank, noise, shuffled};
use std::time::Duration;
use sums::{Repeat, Sums, sums};

/// Most frames a side that are compared at once.
pub const FRAMES_MAX: usize = 1_000;
/// Most random orders of the pixels.
pub const SHUFFLES_MAX: usize = 10_000;
/// Most pairs of frames that are scored again for each random order; more are thinned evenly.
pub const SHUFFLED_PAIRS_MAX: usize = 100;
/// Most pairs of frames of which places, overlaps and structure are looked at; more are thinned evenly. Only the static
/// protocol has as many.
pub const PLACED_PAIRS_MAX: usize = 10_000;
/// Images of the sensor's noise that make up that floor.
pub const NOISE_IMAGES: usize = 20;
/// Most threads that count at once.
pub const THREADS_MAX: usize = 64;
/// Most pairs of frames kept for the report.
pub const FILM_FRAMES_MAX: usize = 6;

/// Which real frame meets which simulated one (PeerJ CS 11:e3124, "Experiments and results").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// Nothing moves: every real frame with every simulated one, averaged.
    Static,
    /// Something moves: frame by frame, at equal times.
    Dynamic,
}

impl Protocol {
    /// The stable name: `static` or `dynamic`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Dynamic => "dynamic",
        }
    }
}

/// Size of a frame in pixels. Frames are row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Pixels in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
}

impl Shape {
    /// Pixels of a frame.
    #[must_use]
    pub const fn pixels(self) -> usize {
        self.columns.saturating_mul(self.rows)
    }
}

/// A frame of the sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct RealFrame {
    /// Time since the first frame of the recording.
    pub time: Duration,
    /// Temperatures in degrees, row by row.
    pub celsius: Vec<f64>,
    /// The sensor's frame [`Settings::lag_frames`] later, if the recording has it: the ceiling is made of these.
    pub later: Option<Vec<f64>>,
}

/// A frame of the simulator.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedFrame {
    /// Time since the start of the scene.
    pub time: Duration,
    /// Temperatures in degrees, row by row, with the sensor's noise.
    pub celsius: Vec<f64>,
    /// The same without noise: which pixels the scene claims to be warm is read from it.
    pub noise_free: Vec<f64>,
    /// The pixels that the scene's agents cover for the greater part, if that is known.
    pub truth: Option<Vec<bool>>,
}

/// How to compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Which frame meets which.
    pub protocol: Protocol,
    /// Ambient temperature of the scene in degrees: the blank frame is of this temperature.
    pub ambient_c: f64,
    /// The sensor's step in degrees, above zero.
    pub step_c: f64,
    /// The bins of the second set of entropies; the first has the paper's 256 grey levels always.
    pub binning: Binning,
    /// Full angles of view across and down, in radians, above 0 and below a half turn: with them a centroid's error is
    /// known in degrees.
    pub field_of_view_rad: Option<[f64; 2]>,
    /// Noise of the sensor in degrees, used where the recording has no repeat to measure it with.
    pub noise_sigma_c: f64,
    /// How many frames later a real frame's repeat is; only printed, the caller picks the frames.
    pub lag_frames: usize,
    /// Random orders of the simulated pixels, up to [`SHUFFLES_MAX`].
    pub shuffles: usize,
    /// Seed of those orders and of the images of noise.
    pub seed: u64,
    /// Threads that count pairs of frames, 1 to [`THREADS_MAX`]; the result is the same with any number.
    pub threads: usize,
    /// What the verdict is measured against.
    pub thresholds: Thresholds,
}

impl Settings {
    /// The defaults for a scene: 0.24 degrees of noise (the median of AMG88xx units at 10 Hz), repeat 3 frames later,
    /// 200 random orders, bins of the sensor's step, one thread.
    #[must_use]
    pub fn new(protocol: Protocol, ambient_c: f64, step_c: f64) -> Self {
        Self {
            protocol,
            ambient_c,
            step_c,
            binning: Binning::Step { width_c: step_c },
            field_of_view_rad: None,
            noise_sigma_c: NOISE_SIGMA_C,
            lag_frames: 3,
            shuffles: 200,
            seed: 0,
            threads: 1,
            thresholds: Thresholds::default(),
        }
    }
}

impl Settings {
    /// From how far above the background on a pixel counts as warm where the noise is `sigma_c`.
    pub(crate) fn warm_above(&self, sigma_c: f64) -> f64 {
        (self.thresholds.warm_sigma * sigma_c).max(WARM_STEPS_MIN * self.step_c)
    }
}

/// Compares the frames of a recording with simulated ones.
///
/// # Errors
/// When a side has no frame or too many, frames differ in size or hold values that are not finite, the dynamic
/// protocol finds unequal numbers of frames, or a setting is out of range.
pub fn compare(
    shape: Shape,
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    settings: &Settings,
) -> Result<Comparison, ValidatorError> {
    compare_beside(shape, real, simulated, settings, &Beside::default())
}

/// The same, with what is known beside the frames.
pub(crate) fn compare_beside(
    shape: Shape,
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    settings: &Settings,
    beside: &Beside,
) -> Result<Comparison, ValidatorError> {
    checks::check_settings(settings)?;
    checks::check_frames(shape, real, simulated, settings.protocol)?;
    let noise_sigma_c = noise_sigma(real);
    let sigma_c = noise_sigma_c.unwrap_or(settings.noise_sigma_c);
    let making = Making {
        shape,
        binning: settings.binning,
        warm_above_c: settings.warm_above(sigma_c),
    };
    let view = SceneView::new(making, real, simulated, settings, sigma_c);
    let pairs = pairs(settings.protocol, real.len(), simulated.len());
    let repeat = Repeat::new(&view, real, noise_sigma_c);
    let found = sums(
        &view,
        &pairs,
        &view.simulated,
        (PLACED_PAIRS_MAX, settings.threads),
    );
    let blank = blank(&view, &pairs);
    let scores = scores(&view, &pairs, [&found, &blank], repeat.as_ref(), settings);
    let above = beside
        .has_people
        .then(|| above_room(real, simulated, &beside.nobody, &beside.room));
    let bootstrap = Bootstrap::new(&view, real, simulated, settings, beside);
    let outcome = Outcome {
        bootstrap,
        nobody: nobody(&view, &pairs, simulated, beside),
        above,
        warm: warm_pixels(&view, &found.union),
        timeline: timeline::timeline(&view, real),
        scores,
        found,
        blank,
        repeat,
        view,
    };
    Ok(outcome.comparison(real, simulated, noise_sigma_c, (settings, beside)))
}

/// All that was counted.
struct Outcome {
    bootstrap: Bootstrap,
    nobody: Option<Nobody>,
    above: Option<AboveRoom>,
    warm: WarmPixels,
    timeline: Vec<FrameScores>,
    scores: Scores,
    found: Sums,
    blank: Sums,
    repeat: Option<Repeat>,
    view: SceneView,
}

impl Outcome {
    fn comparison(
        self,
        real: &[RealFrame],
        simulated: &[SimulatedFrame],
        noise_sigma_c: Option<f64>,
        (settings, beside): (&Settings, &Beside),
    ) -> Comparison {
        let offset_c = median(&self.found.offsets).unwrap_or(0.0);
        let warm_above_c = self.view.making.warm_above_c;
        let evidence = Evidence {
            scores: &self.scores,
            real_frames: real.len(),
            offset_c,
            warm: self.warm,
            warm_above_c,
            lag_frames: settings.lag_frames,
            beside,
            found: &self.bootstrap.found,
            expected: &self.bootstrap.expected,
            alike: self.bootstrap.claim.alike(),
            times: &self.bootstrap.times,
        };
        Comparison {
            judgement: judge(&evidence, &settings.thresholds),
            nobody: self.nobody,
            above_room: self.above,
            pattern_c: mean_square(&pattern_c(settings, beside, self.view.pixels())).sqrt(),
            pattern_from: beside.pattern_from,
            level_max_c: beside.level_c.unwrap_or(settings.thresholds.offset_max_c),
            evaluation: EvaluationGraph {
                thresholds_c: metrics::thresholds_c().to_vec(),
                simulated: self.found.graph.shares().to_vec(),
                blank: self.blank.graph.shares().to_vec(),
                repeat: self.repeat.map(|repeat| repeat.graph.shares().to_vec()),
            },
            film: film(real, simulated),
            shape: self.view.making.shape,
            real_frames: real.len(),
            simulated_frames: simulated.len(),
            pairs: self.found.pairs,
            noise_sigma_c,
            warm_above_c,
            union_above_c: self.view.union_above_c(),
            offset_c,
            drift_c: spread(&self.found.offsets),
            drift_c_per_min: timeline::drift_c_per_min(&self.timeline),
            noise_fit: timeline::noise_fit(&self.view),
            maps: timeline::maps(&self.timeline),
            timeline: self.timeline,
            warm: self.warm,
            settings: *settings,
            background: None,
            warnings: Vec::new(),
            notes: Vec::new(),
            alignment: None,
            scores: self.scores,
        }
    }
}

const NOISE_SIGMA_C: f64 = 0.24;

/// Steps of the sensor that a warm pixel stands out by at least, however little noise there is.
const WARM_STEPS_MIN: f64 = 2.0;

/// Up to `number` of `total` indices, evenly spread, first and last included.
pub(crate) fn evenly(total: usize, number: usize) -> Vec<usize> {
    if number >= total {
        return (0..total).collect();
    }
    if number < 2 {
        return (0..number).collect();
    }
    (0..number)
        .map(|index| index * (total - 1) / (number - 1))
        .collect()
}

fn pairs(protocol: Protocol, real: usize, simulated: usize) -> Vec<(usize, usize)> {
    match protocol {
        Protocol::Static => (0..real)
            .flat_map(|r| (0..simulated).map(move |s| (r, s)))
            .collect(),
        Protocol::Dynamic => (0..real.min(simulated)).map(|k| (k, k)).collect(),
    }
}

/// The sensor's temporal noise: per pixel the root mean square of frame less repeat over the root of two, and of the
/// pixels the median, which a person walking through a part of the view does not move.
fn noise_sigma(real: &[RealFrame]) -> Option<f64> {
    let repeats: Vec<(&[f64], &[f64])> = real
        .iter()
        .filter_map(|frame| Some((frame.celsius.as_slice(), frame.later.as_deref()?)))
        .collect();
    let pixels = repeats.first()?.0.len();
    let sigma = |pixel: usize| {
        let squares: f64 = repeats
            .iter()
            .map(|(now, later)| (later[pixel] - now[pixel]).powi(2))
            .sum();
        (squares / count(repeats.len()) / 2.0).sqrt()
    };
    let sigmas: Vec<f64> = (0..pixels).map(sigma).collect();
    median(&sigmas)
}

fn warm_pixels(view: &SceneView, union: &Union) -> WarmPixels {
    let frames = view.real.iter().map(Prepared::celsius);
    let claims = view.simulated.frames.iter().map(Prepared::steady);
    let above_c = view.making.warm_above_c;
    let (real, simulated) = (view.real.len(), view.simulated.frames.len());
    WarmPixels {
        real: warm_of_themselves(frames, above_c) / count(real),
        claimed: warm_of_themselves(claims, above_c) / count(simulated),
        overlap: (union.pixels > 0).then(|| count(union.both) / count(union.pixels)),
    }
}

/// Warm pixels above the frame's own median: whether a recording is empty must not depend on what the scene claims.
fn warm_of_themselves<'a>(frames: impl Iterator<Item = &'a [f64]>, warm_above_c: f64) -> f64 {
    let warm = |frame: &[f64]| {
        let background = median(frame).unwrap_or(0.0);
        frame
            .iter()
            .filter(|&&value| value - background > warm_above_c)
            .count()
    };
    count(frames.map(warm).sum())
}

/// What the scene scores without its people, under the noise of the simulated frames.
fn nobody(
    view: &SceneView,
    pairs: &[(usize, usize)],
    simulated: &[SimulatedFrame],
    beside: &Beside,
) -> Option<Nobody> {
    if beside.nobody.len() != simulated.len() {
        return None;
    }
    let frame = |(simulated, nobody): (&SimulatedFrame, &Vec<f64>)| {
        let noise = simulated.celsius.iter().zip(&simulated.noise_free);
        let noisy: Vec<f64> = nobody
            .iter()
            .zip(noise)
            .map(|(empty, (noisy, clean))| empty + noisy - clean)
            .collect();
        view.making.simulated(&noisy, nobody, None)
    };
    let side = Side::new(simulated.iter().zip(&beside.nobody).map(frame).collect());
    let thinned = floors::thinned(pairs, PLACED_PAIRS_MAX);
    let sums = sums(view, &thinned, &side, (1, 1));
    Some(Nobody {
        correlation: sums.get(Measure::Correlation),
        gain: sums.get(Measure::Gain),
        has_people: beside.has_people,
    })
}

fn scores(
    view: &SceneView,
    pairs: &[(usize, usize)],
    [found, blank]: [&Sums; 2],
    repeat: Option<&Repeat>,
    settings: &Settings,
) -> Scores {
    let shuffled = shuffled(view, pairs, settings);
    let noise = noise(view, settings.seed);
    let score = |&measure: &Measure| Score {
        measure,
        value: found.get(measure),
        blank: blank.get(measure),
        shuffled: shuffled
            .iter()
            .find(|(of, _)| *of == measure)
            .map(|&(_, shuffled)| shuffled),
        noise: noise.get(measure),
        ceiling: repeat.and_then(|repeat| repeat.ceiling(measure)),
    };
    Scores::new(Measure::ALL.iter().map(score).collect())
}

fn film(real: &[RealFrame], simulated: &[SimulatedFrame]) -> Vec<FilmFrame> {
    let beside = |index: usize| FilmFrame {
        time: real[index].time,
        real: real[index].celsius.clone(),
        simulated: simulated[index].celsius.clone(),
    };
    evenly(real.len().min(simulated.len()), FILM_FRAMES_MAX)
        .into_iter()
        .map(beside)
        .collect()
}

fn spread(values: &[f64]) -> f64 {
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
    (largest - smallest).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_choice_keeps_both_ends() {
        assert_eq!(evenly(10, 3), [0, 4, 9]);
        assert_eq!(evenly(3, 10), [0, 1, 2]);
        assert_eq!(evenly(5, 5), [0, 1, 2, 3, 4]);
        assert_eq!(evenly(5, 1), [0]);
        assert_eq!(evenly(5, 0), Vec::<usize>::new());
        assert_eq!(evenly(0, 4), Vec::<usize>::new());
    }

    #[test]
    fn protocols_pair_as_the_paper_says() {
        assert_eq!(pairs(Protocol::Static, 10, 10).len(), 100);
        assert_eq!(
            pairs(Protocol::Static, 2, 2),
            [(0, 0), (0, 1), (1, 0), (1, 1)]
        );
        assert_eq!(pairs(Protocol::Dynamic, 3, 3), [(0, 0), (1, 1), (2, 2)]);
    }

    #[test]
    fn noise_is_measured_on_the_repeat() {
        let frame = |now: f64, later: f64| RealFrame {
            time: Duration::ZERO,
            celsius: vec![now; 3],
            later: Some(vec![later; 3]),
        };
        let sigma = noise_sigma(&[frame(20.0, 20.5), frame(20.0, 19.5)]).unwrap();
        assert!((sigma - 0.5 / 2.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(
            noise_sigma(&[RealFrame {
                later: None,
                ..frame(20.0, 0.0)
            }]),
            None
        );
    }
}
