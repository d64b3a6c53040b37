use crate::error::{Side, ValidatorError};
use crate::frames::{Means, Prepared, Repeat, SceneView, grid, median, shares_below};
use crate::metrics::{count, mean};
use crate::score::{Measure, Score, Scores, Shuffled};
use crate::shuffle;
use crate::verdict::{Evidence, Judgement, Thresholds, WarmPixels, judge};
use std::time::Duration;

/// Most frames a side that are compared at once.
pub const FRAMES_MAX: usize = 1_000;
/// Most random orders of the pixels.
pub const SHUFFLES_MAX: usize = 10_000;
/// Most pairs of frames that are scored again for each random order; more are thinned evenly.
pub const SHUFFLED_PAIRS_MAX: usize = 100;
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
}

/// How to compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Which frame meets which.
    pub protocol: Protocol,
    /// Ambient temperature of the scene in degrees: the blank frame is of this temperature.
    pub ambient_c: f64,
    /// The sensor's step in degrees, above zero: width of the bins of the `step` entropies.
    pub step_c: f64,
    /// Noise of the sensor in degrees, used where the recording has no repeat to measure it with.
    pub noise_sigma_c: f64,
    /// How many frames later a real frame's repeat is; only printed, the caller picks the frames.
    pub lag_frames: usize,
    /// Random orders of the simulated pixels, up to [`SHUFFLES_MAX`].
    pub shuffles: usize,
    /// Seed of those orders.
    pub seed: u64,
    /// What the verdict is measured against.
    pub thresholds: Thresholds,
}

impl Settings {
    /// The defaults for a scene: 0.24 degrees of noise (the median of AMG88xx units at 10 Hz), repeat 3 frames later,
    /// 200 random orders.
    #[must_use]
    pub fn new(protocol: Protocol, ambient_c: f64, step_c: f64) -> Self {
        Self {
            protocol,
            ambient_c,
            step_c,
            noise_sigma_c: NOISE_SIGMA_C,
            lag_frames: 3,
            shuffles: 200,
            seed: 0,
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
    /// Frames to show, at most [`FILM_FRAMES_MAX`], in order of time.
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
    /// Warm pixels.
    pub warm: WarmPixels,
    /// The settings it was made with.
    pub settings: Settings,
    /// What was assumed or left out on the way here, each a sentence.
    pub notes: Vec<String>,
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
    check_settings(settings)?;
    check_frames(shape, real, simulated, settings.protocol)?;
    let noise_sigma_c = noise_sigma(real);
    let sigma_c = noise_sigma_c.unwrap_or(settings.noise_sigma_c);
    let warm_above_c = settings.warm_above(sigma_c);
    let view = SceneView::new(real, simulated, settings, sigma_c);
    let pairs = pairs(settings.protocol, real.len(), simulated.len());
    let warm = warm_pixels(&view, &pairs, warm_above_c);
    let repeat = Repeat::new(&view, real, noise_sigma_c);
    let scores = scores(&view, &pairs, repeat.as_ref(), settings);
    let offsets = view.offsets(&pairs);
    let offset_c = median(&offsets).unwrap_or(0.0);
    let evidence = Evidence {
        scores: &scores,
        real_frames: real.len(),
        offset_c,
        warm,
        warm_above_c,
        lag_frames: settings.lag_frames,
    };
    Ok(Comparison {
        judgement: judge(&evidence, &settings.thresholds),
        evaluation: evaluation(&view, &pairs, repeat.as_ref()),
        film: film(real, simulated),
        shape,
        real_frames: real.len(),
        simulated_frames: simulated.len(),
        pairs: pairs.len(),
        noise_sigma_c,
        warm_above_c,
        union_above_c: view.union_above_c(),
        offset_c,
        drift_c: spread(&offsets),
        warm,
        settings: *settings,
        notes: Vec::new(),
        scores,
    })
}

impl Comparison {
    /// The score of one measure.
    #[must_use]
    pub fn score(&self, measure: Measure) -> Score {
        self.scores.get(measure)
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

fn check_settings(settings: &Settings) -> Result<(), ValidatorError> {
    let above_zero = |value: f64| value.is_finite() && value > 0.0;
    let refuse = |name, expected, found| {
        Err(ValidatorError::Setting {
            name,
            expected,
            found,
        })
    };
    if !settings.ambient_c.is_finite() {
        return refuse("ambient_c", "a temperature in degrees", settings.ambient_c);
    }
    if !above_zero(settings.step_c) {
        return refuse("step_c", "a width above zero", settings.step_c);
    }
    if !above_zero(settings.noise_sigma_c) {
        return refuse(
            "noise_sigma_c",
            "a deviation above zero",
            settings.noise_sigma_c,
        );
    }
    if settings.shuffles == 0 || settings.shuffles > SHUFFLES_MAX {
        return refuse(
            "shuffles",
            "a number from 1 to 10000",
            count(settings.shuffles),
        );
    }
    Ok(())
}

fn check_frames(
    shape: Shape,
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    protocol: Protocol,
) -> Result<(), ValidatorError> {
    check_number(Side::Real, real.len())?;
    check_number(Side::Simulated, simulated.len())?;
    if protocol == Protocol::Dynamic && real.len() != simulated.len() {
        return Err(ValidatorError::Unpaired {
            real: real.len(),
            simulated: simulated.len(),
        });
    }
    for (index, frame) in real.iter().enumerate() {
        check_frame(shape, Side::Real, index, &frame.celsius)?;
        if let Some(later) = &frame.later {
            check_frame(shape, Side::Real, index, later)?;
        }
    }
    for (index, frame) in simulated.iter().enumerate() {
        check_frame(shape, Side::Simulated, index, &frame.celsius)?;
        check_frame(shape, Side::Simulated, index, &frame.noise_free)?;
    }
    Ok(())
}

fn check_number(side: Side, found: usize) -> Result<(), ValidatorError> {
    match found {
        0 => Err(ValidatorError::NoFrames { side }),
        1..=FRAMES_MAX => Ok(()),
        _ => Err(ValidatorError::TooManyFrames {
            side,
            limit: FRAMES_MAX,
            found,
        }),
    }
}

fn check_frame(
    shape: Shape,
    side: Side,
    index: usize,
    celsius: &[f64],
) -> Result<(), ValidatorError> {
    if celsius.is_empty() || celsius.len() != shape.pixels() {
        return Err(ValidatorError::FrameSize {
            side,
            index,
            expected: shape.pixels(),
            found: celsius.len(),
        });
    }
    match celsius.iter().position(|value| !value.is_finite()) {
        Some(pixel) => Err(ValidatorError::NotFinite { side, index, pixel }),
        None => Ok(()),
    }
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

fn warm_pixels(view: &SceneView, pairs: &[(usize, usize)], warm_above_c: f64) -> WarmPixels {
    let union = view.union(pairs, &view.simulated);
    let frames = view.real.iter().map(Prepared::celsius);
    let claims = view.simulated.iter().map(Prepared::steady);
    WarmPixels {
        real: warm_of_themselves(frames, warm_above_c) / count(view.real.len()),
        claimed: warm_of_themselves(claims, warm_above_c) / count(view.simulated.len()),
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

fn scores(
    view: &SceneView,
    pairs: &[(usize, usize)],
    repeat: Option<&Repeat>,
    settings: &Settings,
) -> Scores {
    let values = means(view, pairs, &view.simulated);
    let blank = view.blank_means();
    let shuffled = shuffled(view, pairs, settings);
    let score = |&measure: &Measure| Score {
        measure,
        value: values.get(measure),
        blank: blank.get(measure),
        shuffled: shuffled
            .iter()
            .find(|(of, _)| *of == measure)
            .map(|&(_, shuffled)| shuffled),
        ceiling: repeat.and_then(|repeat| repeat.ceiling(measure)),
    };
    Scores::new(Measure::ALL.iter().map(score).collect())
}

fn means(view: &SceneView, pairs: &[(usize, usize)], simulated: &[Prepared]) -> Means {
    let mut means = Means::default();
    for &(real, index) in pairs {
        means.add(&view.real[real].pair_values(&simulated[index]));
    }
    for (measure, gain) in view.union(pairs, simulated).gains() {
        means.set(measure, gain);
    }
    means
}

/// One order of the pixels serves all frames of a round, so that what varies between rounds is the place of the
/// pixels and not the average over many places.
fn shuffled(
    view: &SceneView,
    pairs: &[(usize, usize)],
    settings: &Settings,
) -> Vec<(Measure, Shuffled)> {
    let thinned = thinned(pairs);
    let orders = shuffle::orders(view.pixels(), settings.shuffles, settings.seed);
    let rounds: Vec<_> = orders
        .iter()
        .map(|order| {
            let permuted: Vec<Prepared> = view
                .simulated
                .iter()
                .map(|frame| frame.permuted(order))
                .collect();
            means(view, &thinned, &permuted)
        })
        .collect();
    let of = |&measure: &Measure| {
        let values: Vec<f64> = rounds
            .iter()
            .filter_map(|round| round.get(measure))
            .collect();
        Some((measure, summary(measure, values)?))
    };
    Measure::ALL.iter().filter_map(of).collect()
}

fn thinned(pairs: &[(usize, usize)]) -> Vec<(usize, usize)> {
    evenly(pairs.len(), SHUFFLED_PAIRS_MAX)
        .into_iter()
        .map(|index| pairs[index])
        .collect()
}

fn summary(measure: Measure, mut values: Vec<f64>) -> Option<Shuffled> {
    let mean = mean(&values)?;
    values.sort_unstable_by(f64::total_cmp);
    if measure.better() == crate::Better::Lower {
        values.reverse();
    }
    // Nearest rank: the smallest value that at least 95 % of the rounds do not pass.
    let rank = (values.len() * 95).div_ceil(100).saturating_sub(1);
    Some(Shuffled {
        mean,
        p95: *values.get(rank)?,
    })
}

fn evaluation(
    view: &SceneView,
    pairs: &[(usize, usize)],
    repeat: Option<&Repeat>,
) -> EvaluationGraph {
    let thresholds_c = grid();
    let simulated = pairs
        .iter()
        .map(|&(r, s)| (view.real[r].celsius(), view.simulated[s].celsius()));
    let blank = view
        .real
        .iter()
        .map(|real| (real.celsius(), view.blank.celsius()));
    EvaluationGraph {
        simulated: shares_below(&thresholds_c, simulated),
        blank: shares_below(&thresholds_c, blank),
        repeat: repeat.map(|repeat| shares_below(&thresholds_c, repeat.pairs(view))),
        thresholds_c,
    }
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
    fn many_pairs_are_thinned_to_the_limit() {
        let hundred = pairs(Protocol::Static, 10, 10);
        assert_eq!(thinned(&hundred), hundred);
        let many = thinned(&pairs(Protocol::Static, 70, 70));
        assert_eq!(many.len(), SHUFFLED_PAIRS_MAX);
        assert_eq!((many[0], many[SHUFFLED_PAIRS_MAX - 1]), ((0, 0), (69, 69)));
    }

    #[test]
    fn the_95th_of_a_hundred_is_the_95th_best() {
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(
            summary(Measure::Correlation, values.clone()),
            Some(Shuffled {
                mean: 50.5,
                p95: 95.0
            })
        );
        assert_eq!(
            summary(Measure::Rmse, values),
            Some(Shuffled {
                mean: 50.5,
                p95: 6.0
            })
        );
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
