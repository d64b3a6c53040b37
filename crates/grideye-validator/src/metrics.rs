//! The measures of likeness between two frames of equal size, at any resolution, in degrees Celsius.
//!
//! Every function answers `None` where the measure is not defined: frames that are empty, of unequal length or that
//! hold a value that is not finite; a correlation with a frame that has one value only; a bin width that is not
//! above zero. No answer is ever NaN.

/// Accuracy that the datasheet states for the AMG8833, in degrees: an offset of plus or minus this much is within its
/// specification (AMG88 spec, "temperature accuracy").
pub const SENSOR_ACCURACY_C: f64 = 2.5;

/// Threshold of the image similarity, in degrees: two standard deviations, three of which are the sensor's accuracy
/// (PeerJ CS 11:e3124, "Evaluation graph and image similarity"; printed there as 1.66).
pub const IS_THRESHOLD: f64 = 2.0 * SENSOR_ACCURACY_C / 3.0;

/// How temperatures are sorted into the bins that entropy counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Binning {
    /// 256 grey levels over the frame's own range: `round(255 (T - min) / (max - min))`, what an 8-bit picture of the
    /// frame holds. The paper does not name its binning; this one fits its published entropies.
    PaperGrey256,
    /// The nearest multiple of a width in degrees; the sensor's own step is the width that says most.
    Step {
        /// Width of a bin in degrees, above zero.
        width_c: f64,
    },
    /// `n` levels over the frame's own range, the lowest and the highest level at its ends.
    Levels {
        /// Number of levels; with 0 or 1 every pixel falls into the same bin.
        n: u16,
    },
}

/// Pearson's correlation coefficient, -1 to 1 (PeerJ CS 11:e3124, Eq. 1); `None` when one frame has one value only.
#[must_use]
pub fn correlation(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    let (mean_real, mean_simulated) = (mean(real)?, mean(simulated)?);
    let (mut product, mut square_real, mut square_simulated) = (0.0, 0.0, 0.0);
    for (x, y) in real.iter().zip(simulated) {
        let (dx, dy) = (x - mean_real, y - mean_simulated);
        product += dx * dy;
        square_real += dx * dx;
        square_simulated += dy * dy;
    }
    if is_constant(real) || is_constant(simulated) {
        return None;
    }
    finite((product / (square_real.sqrt() * square_simulated.sqrt())).clamp(-1.0, 1.0))
}

/// Shannon's entropy of one frame in bits (PeerJ CS 11:e3124, Eq. 2).
#[must_use]
pub fn entropy(frame: &[f64], binning: Binning) -> Option<f64> {
    Some(entropy_of_bins(&bins(frame, binning)?))
}

/// Entropy of the pairs of pixels in bits (PeerJ CS 11:e3124, Eq. 3). Each frame is binned over its own range.
#[must_use]
pub fn joint_entropy(real: &[f64], simulated: &[f64], binning: Binning) -> Option<f64> {
    comparable(real, simulated)?;
    Some(joint_entropy_of_bins(
        &bins(real, binning)?,
        &bins(simulated, binning)?,
    ))
}

/// Mutual information in bits: `H(X) + H(Y) - H(X, Y)` (PeerJ CS 11:e3124, Eq. 6).
///
/// On 64 pixels and fine bins almost all of it is small-sample bias: read it beside the value of shuffled pixels.
#[must_use]
pub fn mutual_information(real: &[f64], simulated: &[f64], binning: Binning) -> Option<f64> {
    comparable(real, simulated)?;
    let (real, simulated) = (bins(real, binning)?, bins(simulated, binning)?);
    let joint = joint_entropy_of_bins(&real, &simulated);
    Some(mutual_of(
        entropy_of_bins(&real),
        entropy_of_bins(&simulated),
        joint,
    ))
}

/// Share of pixels, 0 to 1, whose temperatures differ by strictly less than `threshold` degrees
/// (PeerJ CS 11:e3124, "Evaluation graph and image similarity"); the paper's threshold is [`IS_THRESHOLD`].
#[must_use]
pub fn image_similarity(real: &[f64], simulated: &[f64], threshold: f64) -> Option<f64> {
    comparable(real, simulated)?;
    let below = differences(real, simulated)
        .filter(|difference| difference.abs() < threshold)
        .count();
    Some(count(below) / count(real.len()))
}

/// The image similarity at each of several thresholds in degrees: the paper's evaluation graph.
#[must_use]
pub fn evaluation_graph(real: &[f64], simulated: &[f64], thresholds: &[f64]) -> Option<Vec<f64>> {
    thresholds
        .iter()
        .map(|&threshold| image_similarity(real, simulated, threshold))
        .collect()
}

/// Root of the mean squared difference, in degrees.
#[must_use]
pub fn rmse(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    let sum: f64 = differences(real, simulated)
        .map(|difference| difference * difference)
        .sum();
    finite((sum / count(real.len())).sqrt())
}

/// Mean of the absolute difference, in degrees.
#[must_use]
pub fn mae(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    finite(differences(real, simulated).map(f64::abs).sum::<f64>() / count(real.len()))
}

/// Mean of simulated less real, in degrees: above zero where the simulation is too warm.
#[must_use]
pub fn bias(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    finite(differences(real, simulated).sum::<f64>() / count(real.len()))
}

/// The bin of each pixel, numbered from 0 upwards without holes in order of temperature.
pub(crate) fn bins(frame: &[f64], binning: Binning) -> Option<Vec<u32>> {
    if frame.is_empty() || !frame.iter().all(|value| value.is_finite()) {
        return None;
    }
    let levels = match binning {
        Binning::PaperGrey256 => levels_over_range(frame, 255.0),
        Binning::Levels { n } => levels_over_range(frame, f64::from(n.saturating_sub(1))),
        Binning::Step { width_c } if width_c.is_finite() && width_c > 0.0 => frame
            .iter()
            .map(|value| (value / width_c).round())
            .collect(),
        Binning::Step { .. } => return None,
    };
    Some(numbered(&levels))
}

/// Entropy in bits of pixels already sorted into bins.
pub(crate) fn entropy_of_bins(bins: &[u32]) -> f64 {
    let mut sorted = bins.to_vec();
    sorted.sort_unstable();
    entropy_of_sorted(&sorted)
}

/// Joint entropy in bits of two frames already sorted into bins.
pub(crate) fn joint_entropy_of_bins(real: &[u32], simulated: &[u32]) -> f64 {
    let pair = |(&x, &y): (&u32, &u32)| (u64::from(x) << 32) | u64::from(y);
    let mut pairs: Vec<u64> = real.iter().zip(simulated).map(pair).collect();
    pairs.sort_unstable();
    entropy_of_sorted(&pairs)
}

/// Mutual information from the three entropies; rounding must not make it negative.
pub(crate) fn mutual_of(entropy_real: f64, entropy_simulated: f64, joint: f64) -> f64 {
    (entropy_real + entropy_simulated - joint).max(0.0)
}

/// A count of pixels, frames or pairs as a number to divide by.
#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "counts of pixels and frames stay far below 2^53, where every integer is exact"
)]
pub(crate) fn count(number: usize) -> f64 {
    number as f64
}

/// The arithmetic mean; `None` of nothing.
pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    finite(values.iter().sum::<f64>() / count(values.len()))
}

fn comparable(real: &[f64], simulated: &[f64]) -> Option<()> {
    let defined = !real.is_empty()
        && real.len() == simulated.len()
        && real.iter().chain(simulated).all(|value| value.is_finite());
    defined.then_some(())
}

fn differences(real: &[f64], simulated: &[f64]) -> impl Iterator<Item = f64> {
    real.iter().zip(simulated).map(|(x, y)| y - x)
}

fn is_constant(frame: &[f64]) -> bool {
    frame.windows(2).all(|pair| pair[0] == pair[1])
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn levels_over_range(frame: &[f64], top: f64) -> Vec<f64> {
    let coldest = frame.iter().copied().fold(f64::INFINITY, f64::min);
    let warmest = frame.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let range = warmest - coldest;
    if range > 0.0 && range.is_finite() {
        frame
            .iter()
            .map(|value| (top * (value - coldest) / range).round())
            .collect()
    } else {
        vec![0.0; frame.len()]
    }
}

fn numbered(levels: &[f64]) -> Vec<u32> {
    let mut order: Vec<usize> = (0..levels.len()).collect();
    order.sort_unstable_by(|&a, &b| levels[a].total_cmp(&levels[b]));
    let mut numbers = vec![0; levels.len()];
    let mut number = 0;
    for neighbours in order.windows(2) {
        // Compared by value, so that the bin of -0 is the bin of 0.
        if levels[neighbours[1]] != levels[neighbours[0]] {
            number += 1;
        }
        numbers[neighbours[1]] = number;
    }
    numbers
}

fn entropy_of_sorted<T: PartialEq>(sorted: &[T]) -> f64 {
    let total = count(sorted.len());
    let plogp = |run: &[T]| {
        let share = count(run.len()) / total;
        share * share.log2()
    };
    // The sum is never above zero, and of one bin it is -0: `max` drops the sign.
    (-sorted.chunk_by(|a, b| a == b).map(plogp).sum::<f64>()).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The two frames of the reference vectors: 8 x 8, B is A with an uneven error and one pixel 2.5 degrees off.
    fn reference_frames() -> (Vec<f64>, Vec<f64>) {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        for row in 0..8_u32 {
            for column in 0..8_u32 {
                let warm = (3..=4).contains(&row) && (2..=3).contains(&column);
                let real = 23.5
                    + 0.25 * f64::from((3 * row + 5 * column) % 7)
                    + if warm { 4.0 } else { 0.0 };
                let spike = if (row, column) == (3, 4) { 2.5 } else { 0.0 };
                let simulated: f64 = real + 0.11 * f64::from((row * column) % 13) - 0.4 + spike;
                a.push(real);
                b.push((simulated * 100.0).round() / 100.0);
            }
        }
        (a, b)
    }

    #[track_caller]
    fn close(found: Option<f64>, expected: f64) {
        let found = found.unwrap();
        assert!(
            (found - expected).abs() < 1e-9,
            "expected {expected}, found {found}"
        );
    }

    #[test]
    fn distances_of_the_reference_vectors() {
        let (a, b) = reference_frames();
        close(correlation(&a, &b), 0.895_076_526_669);
        close(rmse(&a, &b), 0.613_739_817);
        close(mae(&a, &b), 0.419_218_75);
        close(bias(&a, &b), 0.159_843_75);
    }

    #[test]
    fn similarity_of_the_reference_vectors() {
        let (a, b) = reference_frames();
        let graph = evaluation_graph(&a, &b, &[0.25, 0.5, 1.66]).unwrap();
        assert_eq!(graph, [0.3125, 0.781_25, 0.984_375]);
        close(image_similarity(&a, &b, IS_THRESHOLD), 0.984_375);
        assert!((IS_THRESHOLD - 1.666_666_666_666_666_7).abs() < 1e-15);
    }

    #[test]
    fn entropies_of_the_reference_vectors_in_quarter_degrees() {
        let (a, b) = reference_frames();
        let step = Binning::Step { width_c: 0.25 };
        close(entropy(&a, step), 3.089_407_329);
        close(entropy(&b, step), 3.589_474_105);
        close(joint_entropy(&a, &b, step), 5.159_774_414);
        close(mutual_information(&a, &b, step), 1.519_107_019);
    }

    #[test]
    fn entropies_of_the_reference_vectors_in_grey_levels() {
        let (a, b) = reference_frames();
        for grey in [Binning::PaperGrey256, Binning::Levels { n: 256 }] {
            close(entropy(&a, grey), 3.089_407_329);
            close(entropy(&b, grey), 5.452_819_531);
            close(joint_entropy(&a, &b, grey), 5.527_114_648);
            close(mutual_information(&a, &b, grey), 3.015_112_211);
        }
    }

    #[test]
    fn a_difference_equal_to_the_threshold_does_not_count() {
        assert_eq!(
            image_similarity(&[20.0, 20.0], &[20.5, 19.5], 0.5),
            Some(0.0)
        );
        assert_eq!(
            image_similarity(&[20.0, 20.0], &[20.5, 19.5], 0.500_001),
            Some(1.0)
        );
        assert_eq!(image_similarity(&[20.0], &[20.0], 0.0), Some(0.0));
    }

    #[test]
    fn entropies_of_frames_counted_by_hand() {
        let step = Binning::Step { width_c: 1.0 };
        assert_eq!(entropy(&[1.0, 2.0, 3.0, 4.0], step), Some(2.0));
        assert_eq!(entropy(&[1.0, 1.0, 2.0, 2.0], step), Some(1.0));
        assert_eq!(entropy(&[7.0; 5], step), Some(0.0));
        assert_eq!(entropy(&[7.0; 5], Binning::PaperGrey256), Some(0.0));
        assert_eq!(
            joint_entropy(&[1.0, 1.0, 2.0, 2.0], &[5.0, 6.0, 5.0, 6.0], step),
            Some(2.0)
        );
        assert_eq!(
            mutual_information(&[1.0, 1.0, 2.0, 2.0], &[5.0, 6.0, 5.0, 6.0], step),
            Some(0.0)
        );
        assert_eq!(
            mutual_information(&[1.0, 1.0, 2.0, 2.0], &[9.0, 9.0, 8.0, 8.0], step),
            Some(1.0)
        );
        assert_eq!(
            entropy(&[1.0, 2.0, 3.0], Binning::Levels { n: 2 }).map(|h| h > 0.9),
            Some(true)
        );
        assert_eq!(
            entropy(&[1.0, 2.0, 3.0], Binning::Levels { n: 1 }),
            Some(0.0)
        );
        assert_eq!(
            entropy(&[1.0, 2.0, 3.0], Binning::Levels { n: 0 }),
            Some(0.0)
        );
    }

    #[test]
    fn values_around_zero_share_a_bin_whatever_their_sign() {
        let step = Binning::Step { width_c: 1.0 };
        assert_eq!(entropy(&[-0.2, 0.2, -0.4, 0.4], step), Some(0.0));
    }

    #[test]
    fn what_is_not_defined_is_none() {
        let flat = [20.0; 4];
        let slope = [20.0, 21.0, 22.0, 23.0];
        assert_eq!(correlation(&flat, &slope), None);
        assert_eq!(correlation(&slope, &flat), None);
        assert_eq!(correlation(&[], &[]), None);
        assert_eq!(rmse(&slope, &slope[..3]), None);
        assert_eq!(mae(&[f64::NAN], &[1.0]), None);
        assert_eq!(bias(&[1.0], &[f64::INFINITY]), None);
        assert_eq!(entropy(&[f64::NAN], Binning::PaperGrey256), None);
        for width_c in [0.0, -0.25, f64::NAN, f64::INFINITY] {
            assert_eq!(entropy(&slope, Binning::Step { width_c }), None);
        }
    }

    /// The correlation of a constant frame whose mean is not a machine number must not be noise over noise.
    #[test]
    fn a_constant_frame_of_an_odd_value_has_no_correlation() {
        assert_eq!(correlation(&[0.1; 64], &[20.3; 64]), None);
    }
}
