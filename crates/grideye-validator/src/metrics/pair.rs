//! The paper's measures of one pair of 8 x 8 frames, all at once.

use crate::metrics::binning::Binning;
use crate::metrics::counting::{Counter, PIXELS_FAST, Places, mutual_of};
use crate::metrics::distance::{Centered, IS_THRESHOLD};
use crate::numbers::{count, long_count};
use std::sync::LazyLock;

/// Thresholds of the evaluation graph.
pub const THRESHOLDS: usize = 101;

/// What the paper reports of one pair of frames. Entropies are in bits.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct PairScores {
    /// C; `None` where one frame has one value only.
    pub correlation: Option<f64>,
    pub entropy_real: f64,
    pub entropy_simulated: f64,
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
}

impl Scorer {
    /// A scorer.
    #[must_use]
    pub fn new() -> Self {
        Self {
            counter: Counter::new(),
        }
    }

    /// Scores one pair as the functions of this module do; `None` for values not finite or more than 256 bins.
    pub fn score(
        &mut self,
        real: &[f64; PIXELS_FAST],
        simulated: &[f64; PIXELS_FAST],
        binning: Binning,
    ) -> Option<PairScores> {
        let x = self.counter.numbered(real, binning)?;
        let y = self.counter.numbered(simulated, binning)?;
        let joint = self.counter.joint(&x, &y);
        let mut graph = Graph::default();
        let similar = graph.add(real, simulated);
        Some(PairScores {
            correlation: Centered::new(real).correlation(&Centered::new(simulated)),
            entropy_real: x.entropy,
            entropy_simulated: y.entropy,
            joint_entropy: joint.entropy,
            mutual_information: mutual_of(&x, &y, joint),
            image_similarity: count(similar) / count(PIXELS_FAST),
            evaluation_graph: graph.shares(),
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

/// Counts of differences between pixels, by the first threshold that lies above them.
#[derive(Debug, Clone)]
pub(crate) struct Graph {
    first_above: [Counts<u64>; TABLES],
}

/// One count for each threshold and for what is above all, and room for any seven bits: no place is beyond it.
type Counts<T> = [T; 128];

/// Neighboring pixels often share a place: counted in several tables, they do not wait for each other.
const TABLES: usize = 4;

static THRESHOLDS_C: LazyLock<Counts<f64>> = LazyLock::new(|| {
    let mut thresholds = [f64::INFINITY; 128];
    thresholds[..THRESHOLDS].copy_from_slice(&thresholds_c());
    thresholds
});

impl Default for Graph {
    fn default() -> Self {
        Self {
            first_above: [[0; 128]; TABLES],
        }
    }
}

impl Graph {
    /// Adds the pixels of a pair; how many of them differ by less than [`IS_THRESHOLD`].
    pub(crate) fn add(&mut self, real: &[f64], simulated: &[f64]) -> usize {
        let mut similar = 0;
        let thresholds: &Counts<f64> = &THRESHOLDS_C;
        for (real, simulated) in real.chunks(PIXELS_FAST).zip(simulated.chunks(PIXELS_FAST)) {
            let (places, below) = places(thresholds, real, simulated);
            similar += below;
            for (index, place) in places[..real.len()].iter().enumerate() {
                self.first_above[index % TABLES][usize::from(place & 127)] += 1;
            }
        }
        similar
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        let others = other.first_above.iter().flatten();
        for (here, there) in self.first_above.iter_mut().flatten().zip(others) {
            *here += there;
        }
    }

    /// Share of the pixels below each threshold, 0 to 1; nothing at all counts as nothing below.
    pub(crate) fn shares(&self) -> [f64; THRESHOLDS] {
        let first_above: [u64; 128] =
            std::array::from_fn(|index| self.first_above.iter().map(|table| table[index]).sum());
        let pixels = long_count(first_above.iter().sum::<u64>().max(1));
        let mut below = 0;
        std::array::from_fn(|index| {
            below += first_above[index];
            long_count(below) / pixels
        })
    }
}

/// For each pixel the first threshold above the difference (the nearest or the next); how many are below [`IS_THRESHOLD`].
fn places(thresholds: &Counts<f64>, real: &[f64], simulated: &[f64]) -> (Places, usize) {
    let (mut differences, mut places) = ([0.0; PIXELS_FAST], [0; PIXELS_FAST]);
    let mut similar = 0_u64;
    let pixels = real.iter().zip(simulated);
    for ((difference, place), (x, y)) in differences.iter_mut().zip(&mut places).zip(pixels) {
        *difference = (y - x).abs();
        similar += u64::from(*difference < IS_THRESHOLD);
        *place = nearest(*difference);
    }
    for (difference, place) in differences.iter().zip(&mut places) {
        *place += u8::from(thresholds[usize::from(*place & 127)] <= *difference);
    }
    (places, usize::try_from(similar).unwrap_or(PIXELS_FAST))
}

/// The number of the nearest threshold: adding 2^52 leaves the nearest whole number in the lowest bits.
fn nearest(difference: f64) -> u8 {
    const BEYOND: f64 = 101.0;
    let twentieths = difference * PER_DEGREE;
    let twentieths = if twentieths < BEYOND {
        twentieths
    } else {
        BEYOND
    };
    (twentieths + 4_503_599_627_370_496.0)
        .to_bits()
        .to_le_bytes()[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics;
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
            let mut scorer = Scorer::new();
            let first = scorer.score(&x, &y, binning).unwrap();
            let scores = scorer.score(&x, &y, binning).unwrap();
            prop_assert_eq!(&scores, &first, "nothing is left in the tables");
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
        let place = |difference| usize::from(places(&THRESHOLDS_C, &[0.0], &[difference]).0[0]);
        for (index, threshold) in thresholds_c().into_iter().enumerate() {
            assert_eq!(place(threshold), index + 1);
            assert_eq!(place(-threshold), index + 1);
            assert_eq!(place(threshold.next_up()), index + 1);
            if index > 0 {
                assert_eq!(place(threshold.next_down()), index);
                // Between two, and where the nearest changes.
                for part in [0.25, 0.5, 0.75] {
                    assert_eq!(place(threshold - part / PER_DEGREE), index);
                }
            }
        }
        assert_eq!([5.02, 5.03, f64::MAX].map(place), [THRESHOLDS; 3]);
        let similar = |difference| Graph::default().add(&[0.0; 64], &[difference; 64]);
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
            let step = Binning::Step { width_c };
            assert_eq!(scorer.score(&frame, &frame, step), None);
        }
        frame[5] = f64::NAN;
        assert_eq!(scorer.score(&frame, &flat, Binning::PaperGrey256), None);
        assert_eq!(scorer.score(&flat, &frame, Binning::PaperGrey256), None);
    }
}
