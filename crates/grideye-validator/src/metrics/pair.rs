//! All of the paper's measures of one pair of 8 x 8 frames.

use crate::metrics::binning::Binning;
use crate::metrics::counting::{Counter, PIXELS_FAST, Places, low_byte, mutual_of};
use crate::metrics::distance::{Centered, IS_THRESHOLD};
use crate::numbers::{count, long_count};
use std::sync::LazyLock;

/// Number of thresholds of the evaluation graph.
pub const THRESHOLDS: usize = 101;

/// The paper's measures of one pair of frames; entropies in bits.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct PairScores {
    /// C; `None` if a frame is constant.
    pub correlation: Option<f64>,
    pub entropy_real: f64,
    pub entropy_simulated: f64,
    pub joint_entropy: f64,
    /// At least 0.
    pub mutual_information: f64,
    /// IS at [`IS_THRESHOLD`], 0 to 1.
    pub image_similarity: f64,
    /// Evaluation graph: share of pixels below each of [`thresholds_c`], 0 to 1.
    pub evaluation_graph: [f64; THRESHOLDS],
}

/// Scores pairs of 8 x 8 frames, reusing its tables.
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
    /// A scorer with empty tables.
    #[must_use]
    pub fn new() -> Self {
        Self {
            counter: Counter::new(),
        }
    }

    /// Scores one pair; `None` if values are not finite or span more than 256 bins.
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

/// The thresholds of the evaluation graph: 0 to 5 °C in steps of 0.05.
#[must_use]
pub fn thresholds_c() -> [f64; THRESHOLDS] {
    std::array::from_fn(|step| count(step) / PER_DEGREE)
}

const PER_DEGREE: f64 = 20.0;

/// Counts of pixel differences, by the first threshold above them.
#[derive(Debug, Clone)]
pub(crate) struct Graph {
    first_above: [Counts<u64>; TABLES],
}

/// One count per threshold and one for larger differences; 128, so that a 7-bit index needs no bounds check.
type Counts<T> = [T; 128];

/// Neighboring pixels often share a count; several tables keep them from waiting for each other.
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
    /// Adds a pair; returns how many pixels differ by less than [`IS_THRESHOLD`].
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

    /// Share of the pixels below each threshold, 0 to 1; 0 without pixels.
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

/// For each pixel the first threshold above its difference; and how many differ by less than [`IS_THRESHOLD`].
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

fn nearest(difference: f64) -> u8 {
    const BEYOND: f64 = 101.0;
    let twentieths = difference * PER_DEGREE;
    low_byte(if twentieths < BEYOND {
        twentieths
    } else {
        BEYOND
    })
}
