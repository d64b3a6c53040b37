//! Sorts frames into bins and computes entropies by counting.

use crate::metrics::binning::Binning;
use crate::numbers::{all_finite, count, extremes};
use std::sync::LazyLock;

/// Most pixels counted in tables: those of an 8 x 8 sensor.
pub(crate) const PIXELS_FAST: usize = 64;

#[derive(Debug, Clone)]
pub(crate) struct Binned {
    bins: Bins,
    pixels: usize,
    distinct: usize,
    pub(crate) entropy: f64,
}

/// The bin of each pixel, numbered from 0 without gaps.
#[derive(Debug, Clone)]
enum Bins {
    /// Up to [`PIXELS_FAST`] pixels; the rest is 0.
    Few(Places),
    Many(Vec<u32>),
}

pub(crate) type Places = [u8; PIXELS_FAST];

#[derive(Debug, Clone, Copy)]
pub(crate) struct Joint {
    pub(crate) entropy: f64,
    pub(crate) distinct: usize,
}

/// Tables for counting, reused for every frame and pair.
pub(crate) struct Counter {
    pairs: Box<[u8; PIXELS_FAST * PIXELS_FAST]>,
    terms: &'static Terms,
}

impl Counter {
    pub(crate) fn new() -> Self {
        Self {
            pairs: Box::new([0; PIXELS_FAST * PIXELS_FAST]),
            terms: &TERMS,
        }
    }

    /// Sorts a frame into bins; `None` if the frame or binning is invalid.
    pub(crate) fn binned(&self, frame: &[f64], binning: Binning) -> Option<Binned> {
        if let Some(binned) = self.numbered(frame, binning) {
            return Some(binned);
        }
        let bins = naive::bins(frame, binning)?;
        let (entropy, distinct) = naive::entropy(&bins);
        Some(Binned {
            bins: Bins::Many(bins),
            pixels: frame.len(),
            distinct,
            entropy,
        })
    }

    pub(crate) fn joint(&mut self, real: &Binned, simulated: &Binned) -> Joint {
        match (&real.bins, &simulated.bins) {
            (Bins::Few(x), Bins::Few(y)) => self.count_pairs(x, y, real.pixels),
            _ => {
                let (entropy, distinct) = naive::joint(&real.numbers(), &simulated.numbers());
                Joint { entropy, distinct }
            }
        }
    }

    fn count_pairs(&mut self, x: &Places, y: &Places, pixels: usize) -> Joint {
        // Both numbers are below 64; the mask removes the bounds check.
        let cells: [u16; PIXELS_FAST] =
            std::array::from_fn(|pixel| (u16::from(x[pixel]) << 6 | u16::from(y[pixel])) & 0xFFF);
        let cells = &cells[..pixels.min(PIXELS_FAST)];
        let (mut sum, mut distinct) = (0, 0);
        for &cell in cells {
            let count = &mut self.pairs[usize::from(cell)];
            sum += self.terms.rises[usize::from(*count & 63)];
            distinct += usize::from(*count == 0);
            *count += 1;
        }
        for &cell in cells {
            self.pairs[usize::from(cell)] = 0;
        }
        Joint {
            entropy: self.terms.entropy(sum, pixels),
            distinct,
        }
    }

    /// `None` if the frame is too large, not finite, or spans more than 256 levels.
    pub(crate) fn numbered(&self, frame: &[f64], binning: Binning) -> Option<Binned> {
        if frame.is_empty() || frame.len() > PIXELS_FAST || !all_finite(frame) {
            return None;
        }
        let mut levels = [0; PIXELS_FAST];
        levels_of(frame, extremes(frame), binning, &mut levels)?;
        // How often each level occurred, and its bin number.
        let (mut counts, mut numbers) = ([0_u8; 256], [0_u8; 256]);
        let (mut sum, mut distinct) = (0, 0);
        let mut places = [0; PIXELS_FAST];
        for (&level, place) in levels[..frame.len()].iter().zip(&mut places) {
            let level = usize::from(level);
            let before = counts[level];
            if before == 0 {
                numbers[level] = distinct;
                distinct += 1;
            }
            counts[level] = before + 1;
            sum += self.terms.rises[usize::from(before & 63)];
            *place = numbers[level];
        }
        Some(Binned {
            bins: Bins::Few(places),
            pixels: frame.len(),
            distinct: usize::from(distinct),
            entropy: self.terms.entropy(sum, frame.len()),
        })
    }
}

impl Binned {
    pub(crate) fn of_nothing(pixels: usize) -> Self {
        Self {
            bins: Bins::Many(vec![0; pixels]),
            pixels,
            distinct: 1,
            entropy: 0.0,
        }
    }

    pub(crate) fn permuted(&self, order: &[usize]) -> Self {
        let bins = match &self.bins {
            Bins::Few(places) => {
                let mut moved = [0; PIXELS_FAST];
                for (to, &from) in moved.iter_mut().zip(order) {
                    *to = places[from];
                }
                Bins::Few(moved)
            }
            Bins::Many(bins) => Bins::Many(order.iter().map(|&index| bins[index]).collect()),
        };
        Self { bins, ..*self }
    }

    fn numbers(&self) -> Vec<u32> {
        match &self.bins {
            Bins::Few(places) => places[..self.pixels.min(PIXELS_FAST)]
                .iter()
                .map(|&place| u32::from(place))
                .collect(),
            Bins::Many(bins) => bins.clone(),
        }
    }
}

/// Mutual information, bits; rounding must not make it negative.
pub(crate) fn mutual_of(real: &Binned, simulated: &Binned, joint: Joint) -> f64 {
    (real.entropy + simulated.entropy - joint.entropy).max(0.0)
}

/// Mutual information less the small-sample bias (Miller 1955 and Madow); below zero where less than chance.
pub(crate) fn mutual_corrected(real: &Binned, simulated: &Binned, joint: Joint) -> f64 {
    let missing = |distinct: usize| count(distinct.saturating_sub(1));
    let nats = (missing(real.distinct) + missing(simulated.distinct) - missing(joint.distinct))
        / (2.0 * count(real.pixels.max(1)));
    real.entropy + simulated.entropy - joint.entropy + nats / std::f64::consts::LN_2
}

/// `k log2 k` for the counts of up to 64 pixels, in fixed point.
struct Terms {
    values: [u64; PIXELS_FAST + 1],
    /// From `k` to `k + 1`.
    rises: [u64; PIXELS_FAST],
}

static TERMS: LazyLock<Terms> = LazyLock::new(Terms::new);

/// 2^50: the sum over 64 pixels is at most 384, which takes 9 binary digits.
const FIXED_POINT: f64 = 1_125_899_906_842_624.0;

impl Terms {
    fn new() -> Self {
        let mut values = [0; PIXELS_FAST + 1];
        for (k, value) in values.iter_mut().enumerate().skip(2) {
            *value = fixed_point(count(k) * count(k).log2());
        }
        let mut rises = [0; PIXELS_FAST];
        for (k, rise) in rises.iter_mut().enumerate() {
            *rise = values[k + 1] - values[k];
        }
        Self { values, rises }
    }

    /// `log2 N - sum / N`, never below zero, exactly zero for one bin.
    fn entropy(&self, sum: u64, pixels: usize) -> f64 {
        let missing = self.values[pixels & 127].saturating_sub(sum);
        from_fixed_point(missing) / count(pixels)
    }
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 0 and 2^59, rounded on purpose"
)]
fn fixed_point(value: f64) -> u64 {
    (value * FIXED_POINT).round() as u64
}

#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "more digits than a floating-point number holds are not asked for"
)]
fn from_fixed_point(value: u64) -> f64 {
    value as f64 / FIXED_POINT
}

/// The level of each pixel, 0 to 255; `None` if there are more, or the bin width is invalid.
fn levels_of(
    frame: &[f64],
    extremes: (f64, f64),
    binning: Binning,
    levels: &mut Places,
) -> Option<()> {
    match binning {
        Binning::PaperGrey256 => levels_over_range(frame, extremes, 255.0, levels),
        Binning::Levels { n } if n <= 256 => {
            levels_over_range(frame, extremes, f64::from(n.saturating_sub(1)), levels)
        }
        Binning::Levels { .. } => None,
        Binning::Step { width_c } => steps(frame, extremes, width_c, levels),
    }
}

/// `None` if the range is so large that 255 times it overflows.
fn levels_over_range(
    frame: &[f64],
    (coldest, warmest): (f64, f64),
    top: f64,
    levels: &mut Places,
) -> Option<()> {
    let range = warmest - coldest;
    if range > 1e300 {
        return None;
    }
    if range > 0.0 {
        for (&value, level) in frame.iter().zip(levels) {
            *level = low_byte(half_up(top * (value - coldest) / range));
        }
    }
    Some(())
}

/// Steps above the lowest one. A colder value never has a higher number, so the extremes have the extreme numbers.
fn steps(
    frame: &[f64],
    (coldest, warmest): (f64, f64),
    width_c: f64,
    levels: &mut Places,
) -> Option<()> {
    if !(width_c.is_finite() && width_c > 0.0) {
        return None;
    }
    let number = |value: f64| {
        let steps = value / width_c;
        half_up(steps.abs()).copysign(steps)
    };
    let (lowest, highest) = (number(coldest), number(warmest));
    // Beyond 2^51 `half_up` is inexact; such frames are not temperatures, and sorting handles them.
    if highest - lowest > 255.0 || highest.abs().max(lowest.abs()) > 1e15 {
        return None;
    }
    if coldest < 0.0 {
        for (&value, level) in frame.iter().zip(levels) {
            *level = low_byte(number(value) - lowest);
        }
        return Some(());
    }
    // Rooms are above 0 °C, and without signs it is half the work.
    for (&value, level) in frame.iter().zip(levels) {
        *level = low_byte(half_up(value / width_c) - lowest);
    }
    Some(())
}

/// 2^52: adding it rounds to an integer, half to even, in the lowest bits.
const ROUNDING: f64 = 4_503_599_627_370_496.0;

/// `round` for 0 to 2^51, in instructions that vectorize on every machine.
fn half_up(value: f64) -> f64 {
    let even = (value + ROUNDING) - ROUNDING;
    if value - even == 0.5 {
        even + 1.0
    } else {
        even
    }
}

/// The nearest integer, 0 to 255, as a byte.
pub(crate) fn low_byte(number: f64) -> u8 {
    (number + ROUNDING).to_bits().to_le_bytes()[0]
}

/// The definitions taken literally: for frames of any size, and as the reference for testing the tables.
mod naive {
    use crate::metrics::binning::Binning;
    use crate::numbers::{all_finite, count, extremes};

    /// The bin of each pixel, numbered from 0 without gaps in order of temperature.
    pub(crate) fn bins(frame: &[f64], binning: Binning) -> Option<Vec<u32>> {
        if frame.is_empty() || !all_finite(frame) {
            return None;
        }
        let levels = match binning {
            Binning::PaperGrey256 => over_range(frame, 255.0),
            Binning::Levels { n } => over_range(frame, f64::from(n.saturating_sub(1))),
            Binning::Step { width_c } if width_c.is_finite() && width_c > 0.0 => frame
                .iter()
                .map(|value| (value / width_c).round())
                .collect(),
            Binning::Step { .. } => return None,
        };
        Some(numbered(&levels))
    }

    pub(crate) fn entropy(bins: &[u32]) -> (f64, usize) {
        let mut sorted = bins.to_vec();
        sorted.sort_unstable();
        of_sorted(&sorted)
    }

    pub(crate) fn joint(real: &[u32], simulated: &[u32]) -> (f64, usize) {
        let pair = |(&x, &y): (&u32, &u32)| (u64::from(x) << 32) | u64::from(y);
        let mut pairs: Vec<u64> = real.iter().zip(simulated).map(pair).collect();
        pairs.sort_unstable();
        of_sorted(&pairs)
    }

    fn over_range(frame: &[f64], top: f64) -> Vec<f64> {
        let (coldest, warmest) = extremes(frame);
        let range = warmest - coldest;
        if range > 0.0 && range.is_finite() {
            let level = |value: &f64| (top * (value - coldest) / range).round();
            frame.iter().map(level).collect()
        } else {
            vec![0.0; frame.len()]
        }
    }

    fn numbered(levels: &[f64]) -> Vec<u32> {
        let mut order: Vec<usize> = (0..levels.len()).collect();
        order.sort_unstable_by(|&a, &b| levels[a].total_cmp(&levels[b]));
        let mut numbers = vec![0; levels.len()];
        let mut number = 0;
        for neighbors in order.windows(2) {
            // By value, so that -0 and 0 share a bin.
            if levels[neighbors[1]] != levels[neighbors[0]] {
                number += 1;
            }
            numbers[neighbors[1]] = number;
        }
        numbers
    }

    fn of_sorted<T: PartialEq>(sorted: &[T]) -> (f64, usize) {
        let total = count(sorted.len());
        let (mut sum, mut distinct) = (0.0, 0);
        for run in sorted.chunk_by(|a, b| a == b) {
            let share = count(run.len()) / total;
            sum += share * share.log2();
            distinct += 1;
        }
        // Never above zero, and -0 for one bin: `max` drops the sign.
        ((-sum).max(0.0), distinct)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn binning() -> impl Strategy<Value = Binning> {
        prop_oneof![
            Just(Binning::PaperGrey256),
            (1_u32..400).prop_map(|width| Binning::Step {
                width_c: f64::from(width) / 100.0
            }),
            (0_u16..400).prop_map(|n| Binning::Levels { n }),
        ]
    }

    /// Quarter degrees, where levels fall on halves, and arbitrary numbers.
    fn pixels() -> impl Strategy<Value = Vec<(f64, f64)>> {
        let quarter = || (-60_i32..140).prop_map(|word| f64::from(word) * 0.25);
        let any = || prop_oneof![9 => quarter(), 1 => proptest::num::f64::NORMAL];
        prop_oneof![
            4 => proptest::collection::vec((quarter(), quarter()), 1..=PIXELS_FAST),
            2 => proptest::collection::vec((-10.0..60.0_f64, -10.0..60.0_f64), 1..=PIXELS_FAST),
            1 => proptest::collection::vec((any(), any()), 1..=PIXELS_FAST),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        /// Bin numbers may differ, but the same pixels share a bin, and all entropies are equal.
        #[test]
        fn tables_give_what_the_definitions_give(pairs in pixels(), binning in binning()) {
            let (x, y): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
            let mut counter = Counter::new();
            let fast = [&x, &y].map(|frame| counter.binned(frame, binning).unwrap());
            let slow = [&x, &y].map(|frame| naive::bins(frame, binning).unwrap());
            for (fast, slow) in fast.iter().zip(&slow) {
                let bins = fast.numbers();
                for i in 0..slow.len() {
                    prop_assert_eq!(bins[i] == bins[0], slow[i] == slow[0]);
                }
                let (entropy, distinct) = naive::entropy(slow);
                prop_assert!((fast.entropy - entropy).abs() < 1e-12);
                prop_assert_eq!(fast.distinct, distinct);
            }
            for _ in 0..2 {
                let joint = counter.joint(&fast[0], &fast[1]);
                let (entropy, distinct) = naive::joint(&slow[0], &slow[1]);
                prop_assert!((joint.entropy - entropy).abs() < 1e-12, "the tables must be empty again");
                prop_assert_eq!(joint.distinct, distinct);
            }
        }

        #[test]
        fn half_up_is_round(value in prop_oneof![0.0..300.0_f64, (0_u32..600).prop_map(|n| f64::from(n) / 2.0)]) {
            prop_assert_eq!(half_up(value), value.round());
        }
    }

    #[test]
    fn half_up_of_the_largest_number_below_a_half_is_zero() {
        assert_eq!(half_up(0.499_999_999_999_999_94), 0.0);
    }
}
