//! The paper's measures of one pair of 8 x 8 frames, all at once and without allocating.

use super::bins::{Counter, PIXELS_FAST};
use super::{Binning, IS_THRESHOLD, all_finite, correlation_of, count, is_constant, mean, sum_of};

/// Thresholds of the evaluation graph.
pub const THRESHOLDS: usize = 101;

/// What the paper reports of one pair of frames. Entropies are in bits.
#[derive(Debug, Clone, PartialEq)]
pub struct PairScores {
    /// C; `None` where one frame has one value only.
    pub correlation: Option<f64>,
    /// Entropy of the real frame.
    pub entropy_real: f64,
    /// Entropy of the simulated frame.
    pub entropy_simulated: f64,
    /// Joint entropy.
    pub joint_entropy: f64,
    /// Mutual information, at least 0.
    pub mutual_information: f64,
    /// IS at [`IS_THRESHOLD`], 0 to 1.
    pub image_similarity: f64,
    /// The evaluation graph: share of pixels below each of [`thresholds_c`], 0 to 1.
    pub evaluation_graph: [f64; THRESHOLDS],
}

/// Scores pairs of 8 x 8 frames; the room to count in is made once.
///
/// ```
/// use grideye_validator::metrics::{Binning, Scorer};
///
/// let mut real = [20.0; 64];
/// real[9] = 23.0;
/// let scores = Scorer::new().score(&real, &real, Binning::PaperGrey256).expect("finite frames");
/// assert_eq!(scores.correlation, Some(1.0));
/// assert_eq!(scores.mutual_information, scores.entropy_real);
/// ```
pub struct Scorer {
    counter: Counter,
    graph: Graph,
}

impl Scorer {
    /// A scorer.
    #[must_use]
    pub fn new() -> Self {
        Self {
            counter: Counter::new(),
            graph: Graph::default(),
        }
    }

    /// Scores one pair; `None` where a value is not finite, the frames spread over more than 256 bins, or the width of
    /// the bins makes no sense. Equal to [`correlation`](super::correlation), [`entropy`](super::entropy),
    /// [`joint_entropy`](super::joint_entropy), [`mutual_information`](super::mutual_information),
    /// [`image_similarity`](super::image_similarity) and [`evaluation_graph`](super::evaluation_graph) but for rounding.
    pub fn score(
        &mut self,
        real: &[f64; PIXELS_FAST],
        simulated: &[f64; PIXELS_FAST],
        binning: Binning,
    ) -> Option<PairScores> {
        let x = self.counter.numbered(real, binning)?;
        let y = self.counter.numbered(simulated, binning)?;
        let joint = self.counter.joint_numbered(&x, &y).entropy;
        let entropy_real = self.counter.entropy(&x, PIXELS_FAST);
        let entropy_simulated = self.counter.entropy(&y, PIXELS_FAST);
        let (similar, evaluation_graph) = self.graph.of_pair(real, simulated);
        Some(PairScores {
            correlation: correlation(real, simulated),
            entropy_real,
            entropy_simulated,
            joint_entropy: joint,
            mutual_information: (entropy_real + entropy_simulated - joint).max(0.0),
            image_similarity: count(similar) / count(PIXELS_FAST),
            evaluation_graph,
        })
    }
}

impl Default for Scorer {
    fn default() -> Self {
        Self::new()
    }
}

/// The thresholds of the evaluation graph: 0 to 5 degrees in steps of a twentieth.
#[must_use]
pub fn thresholds_c() -> [f64; THRESHOLDS] {
    std::array::from_fn(|step| count(step) / PER_DEGREE)
}

const PER_DEGREE: f64 = 20.0;
/// Of a frame; a power of two, of which the reciprocal is exact.
const PIXELS: f64 = 64.0;

/// Counts of differences between pixels, by the first threshold that lies above them.
#[derive(Debug, Clone)]
pub(crate) struct Graph {
    thresholds: [f64; THRESHOLDS + 1],
    first_above: [u64; THRESHOLDS + 1],
}

impl Default for Graph {
    fn default() -> Self {
        let mut thresholds = [f64::INFINITY; THRESHOLDS + 1];
        thresholds[..THRESHOLDS].copy_from_slice(&thresholds_c());
        Self {
            thresholds,
            first_above: [0; THRESHOLDS + 1],
        }
    }
}

impl Graph {
    /// The graph of one pair alone, behind the number of its pixels that differ by less than [`IS_THRESHOLD`].
    ///
    /// Counts of 64 pixels fit into bytes, and their shares need no division.
    fn of_pair(
        &self,
        real: &[f64; PIXELS_FAST],
        simulated: &[f64; PIXELS_FAST],
    ) -> (usize, [f64; THRESHOLDS]) {
        let mut first_above = [0_u8; THRESHOLDS + 1];
        let mut similar = 0;
        for (x, y) in real.iter().zip(simulated) {
            let difference = (y - x).abs();
            similar += usize::from(difference < IS_THRESHOLD);
            first_above[self.place(difference)] += 1;
        }
        let mut below = 0;
        let counts: [u8; THRESHOLDS] = std::array::from_fn(|index| {
            below += first_above[index];
            below
        });
        (similar, counts.map(|count| f64::from(count) / PIXELS))
    }

    /// Adds the pixels of a pair; how many of them differ by less than [`IS_THRESHOLD`].
    pub(crate) fn add(&mut self, real: &[f64], simulated: &[f64]) -> usize {
        let mut similar = 0;
        for (x, y) in real.iter().zip(simulated) {
            let difference = (y - x).abs();
            similar += usize::from(difference < IS_THRESHOLD);
            self.first_above[self.place(difference)] += 1;
        }
        similar
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        for (here, there) in self.first_above.iter_mut().zip(other.first_above) {
            *here += there;
        }
    }

    /// Share of the pixels below each threshold, 0 to 1; nothing at all counts as nothing below.
    pub(crate) fn shares(&self) -> [f64; THRESHOLDS] {
        let pixels = self.first_above.iter().sum::<u64>().max(1);
        let pixels = number(pixels);
        let mut below = 0;
        std::array::from_fn(|index| {
            below += self.first_above[index];
            number(below) / pixels
        })
    }

    /// The first threshold above a difference. The product is off by a rounding at most, so that the place is off by
    /// one at most: both neighbours are asked.
    fn place(&self, difference: f64) -> usize {
        let guess = whole(difference * PER_DEGREE);
        let at = |index: usize| self.thresholds[index.min(THRESHOLDS)];
        let up = usize::from(at(guess) <= difference);
        let down = usize::from(guess > 0 && at(guess.saturating_sub(1)) > difference);
        (guess + up - down).min(THRESHOLDS)
    }
}

fn correlation(real: &[f64; PIXELS_FAST], simulated: &[f64; PIXELS_FAST]) -> Option<f64> {
    if !(all_finite(real) && all_finite(simulated)) || is_constant(real) || is_constant(simulated) {
        return None;
    }
    let (real_mean, simulated_mean) = (mean(real)?, mean(simulated)?);
    let deviations = |frame: &[f64; PIXELS_FAST], mean: f64| frame.map(|value| value - mean);
    let (x, y) = (
        deviations(real, real_mean),
        deviations(simulated, simulated_mean),
    );
    correlation_of(
        sum_of(&x, &y, |x, y| x * y),
        sum_of(&x, &x, |x, _| x * x),
        sum_of(&y, &y, |y, _| y * y),
    )
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "not negative; cut at the number of thresholds, whole numbers below it on purpose"
)]
fn whole(value: f64) -> usize {
    (value as usize).min(THRESHOLDS)
}

#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "a count of pixels, far below 2^53"
)]
fn number(count: u64) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use super::super as metrics;
    use super::*;
    use proptest::prelude::*;

    fn frame() -> impl Strategy<Value = [f64; 64]> {
        let pixel = prop_oneof![
            3 => (60_i32..140).prop_map(|word| f64::from(word) * 0.25),
            1 => (1_500_i32..3_000).prop_map(|word| f64::from(word) * 0.01),
            1 => 10.0..40.0_f64,
        ];
        proptest::collection::vec(pixel, 64).prop_map(|frame| frame.try_into().unwrap())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        #[test]
        fn all_at_once_is_each_on_its_own((x, y) in (frame(), frame()), step in prop_oneof![Just(None), Just(Some(0.25))]) {
            let binning = step.map_or(Binning::PaperGrey256, |width_c| Binning::Step { width_c });
            let scores = Scorer::new().score(&x, &y, binning).unwrap();
            let close = |found: f64, expected: Option<f64>| (found - expected.unwrap()).abs() < 1e-12;
            prop_assert!(close(scores.correlation.unwrap(), metrics::correlation(&x, &y)));
            prop_assert!(close(scores.entropy_real, metrics::entropy(&x, binning)));
            prop_assert!(close(scores.entropy_simulated, metrics::entropy(&y, binning)));
            prop_assert!(close(scores.joint_entropy, metrics::joint_entropy(&x, &y, binning)));
            prop_assert!(close(scores.mutual_information, metrics::mutual_information(&x, &y, binning)));
            prop_assert!(close(scores.image_similarity, metrics::image_similarity(&x, &y, IS_THRESHOLD)));
            let graph = metrics::evaluation_graph(&x, &y, &thresholds_c()).unwrap();
            prop_assert_eq!(scores.evaluation_graph.to_vec(), graph);
        }
    }

    /// Differences of exactly a threshold, a little more and a little less, beyond the last and none.
    #[test]
    fn differences_at_a_threshold_fall_on_its_far_side() {
        let graph = Graph::default();
        for (index, threshold) in thresholds_c().into_iter().enumerate() {
            assert_eq!(graph.place(threshold), index + 1);
            assert_eq!(graph.place(threshold.next_up()), index + 1);
            if index > 0 {
                assert_eq!(graph.place(threshold.next_down()), index);
            }
        }
        assert_eq!(graph.place(f64::MAX), THRESHOLDS);
        let similar = |difference| graph.of_pair(&[0.0; 64], &[difference; 64]).0;
        assert_eq!(similar(IS_THRESHOLD), 0);
        assert_eq!(similar(IS_THRESHOLD.next_down()), 64);
    }

    #[test]
    fn what_is_not_defined_is_none() {
        let (mut frame, flat) = ([20.0; 64], [20.0; 64]);
        frame[3] = 21.0;
        let mut scorer = Scorer::new();
        let scores = scorer.score(&frame, &flat, Binning::PaperGrey256).unwrap();
        assert_eq!((scores.correlation, scores.entropy_simulated), (None, 0.0));
        for width_c in [0.0, f64::NAN] {
            assert_eq!(
                scorer.score(&frame, &frame, Binning::Step { width_c }),
                None
            );
        }
        frame[5] = f64::NAN;
        assert_eq!(scorer.score(&frame, &flat, Binning::PaperGrey256), None);
        assert_eq!(scorer.score(&flat, &frame, Binning::PaperGrey256), None);
    }
}
