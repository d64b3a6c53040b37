//! The measures of likeness between two frames of equal size, at any resolution, in degrees Celsius.
//!
//! Every function answers `None` where the measure is not defined: frames that are empty, of unequal length or that
//! hold a value that is not finite; a correlation with a frame that has one value only; a bin width that is not
//! above zero. No answer is ever NaN. The glossary in this crate's README lists each with its unit and source.

mod binning;
mod bins;
mod blob;
mod noise;
mod pair;
mod structure;

pub use binning::{Binning, BinningError};
pub use blob::{Blob, angle_between, overlap, warm};
pub use noise::{ChiSquared, chi_squared, survival};
pub use pair::{PairScores, Scorer, THRESHOLDS, thresholds_c};
pub use structure::{SSIM_RANGE_C, structural_similarity, structure_map};

pub(crate) use bins::{Binned, Counter, mutual_corrected, mutual_of};
pub(crate) use pair::Graph;

/// Accuracy that the datasheet states for the AMG8833, in degrees: an offset of plus or minus this much is within its
/// specification (AMG88 spec, "temperature accuracy").
pub const SENSOR_ACCURACY_C: f64 = 2.5;

/// Threshold of the image similarity, in degrees: two standard deviations, three of which are the sensor's accuracy
/// (PeerJ CS 11:e3124, "Evaluation graph and image similarity"; printed there as 1.66).
pub const IS_THRESHOLD: f64 = 2.0 * SENSOR_ACCURACY_C / 3.0;

/// Pearson's correlation coefficient, -1 to 1 (PeerJ CS 11:e3124, Eq. 1); `None` when one frame has one value only.
#[must_use]
pub fn correlation(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    Centred::new(real).correlation(&Centred::new(simulated))
}

/// Shannon's entropy of one frame in bits (PeerJ CS 11:e3124, Eq. 2).
#[must_use]
pub fn entropy(frame: &[f64], binning: Binning) -> Option<f64> {
    Some(Counter::new().binned(frame, binning)?.entropy())
}

/// Entropy of the pairs of pixels in bits (PeerJ CS 11:e3124, Eq. 3). Each frame is binned over its own range.
#[must_use]
pub fn joint_entropy(real: &[f64], simulated: &[f64], binning: Binning) -> Option<f64> {
    let (_, _, joint) = binned(real, simulated, binning)?;
    Some(joint.entropy)
}

/// Mutual information in bits: `H(X) + H(Y) - H(X, Y)` (PeerJ CS 11:e3124, Eq. 6).
///
/// On 64 pixels and fine bins almost all of it is small-sample bias: read it beside the value of shuffled pixels, or
/// take [`mutual_information_corrected`].
#[must_use]
pub fn mutual_information(real: &[f64], simulated: &[f64], binning: Binning) -> Option<f64> {
    let (real, simulated, joint) = binned(real, simulated, binning)?;
    Some(mutual_of(&real, &simulated, joint))
}

/// Mutual information in bits less its small-sample bias of the first order, after Miller and Madow (G. A. Miller,
/// "Note on the bias of information estimates", 1955): `I + (K(X) + K(Y) - K(X, Y) - 1) / (2 N ln 2)` with K bins that
/// occur. Below zero where the pixels have less in common than chance. With more bins than pixels in each the first
/// order is not enough: read it beside the shuffled pixels all the same.
#[must_use]
pub fn mutual_information_corrected(
    real: &[f64],
    simulated: &[f64],
    binning: Binning,
) -> Option<f64> {
    let (real, simulated, joint) = binned(real, simulated, binning)?;
    finite(mutual_corrected(&real, &simulated, joint))
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
    finite((sum_of(real, simulated, |x, y| (y - x) * (y - x)) / count(real.len())).sqrt())
}

/// The same over the pixels of a mask, for example those that the simulated agent covers; `None` if it marks none.
#[must_use]
pub fn foreground_rmse(real: &[f64], simulated: &[f64], mask: &[bool]) -> Option<f64> {
    comparable(real, simulated)?;
    if mask.len() != real.len() {
        return None;
    }
    let pixels = mask.iter().filter(|&&marked| marked).count();
    let marked = |(difference, &marked): (f64, &bool)| marked.then_some(difference * difference);
    let squares: f64 = differences(real, simulated)
        .zip(mask)
        .filter_map(marked)
        .sum();
    finite((squares / count(pixels)).sqrt()).filter(|_| pixels > 0)
}

/// Mean of the absolute difference, in degrees.
#[must_use]
pub fn mae(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    finite(sum_of(real, simulated, |x, y| (y - x).abs()) / count(real.len()))
}

/// Mean of simulated less real, in degrees: above zero where the simulation is too warm.
#[must_use]
pub fn bias(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    finite(sum_of(real, simulated, |x, y| y - x) / count(real.len()))
}

/// Degrees that the real frame rises by where the claim rises by one: the slope of the least-squares line of real over
/// claimed pixels. 1 says that the contrast is right, below 1 that the scene claims too much of it, 0 that what is
/// claimed is not there. `None` for a claim of one value.
///
/// Hand in the noise-free image as the claim: noise in it would lower the slope (regression dilution), noise in the
/// real frame does not.
#[must_use]
pub fn contrast_slope(real: &[f64], claim: &[f64]) -> Option<f64> {
    comparable(real, claim)?;
    Centred::new(real).slope_over(&Centred::new(claim))
}

/// Slope of the least-squares line through points `(x, y)`: the drift, where x is time and y a temperature. `None` where
/// all x are equal or fewer than two points are given.
#[must_use]
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    contrast_slope(&y, &x)
}

/// A frame less its own mean.
#[derive(Debug, Clone)]
pub(crate) struct Centred {
    deviations: Vec<f64>,
    squares: f64,
}

impl Centred {
    pub(crate) fn new(frame: &[f64]) -> Self {
        let mean = mean(frame).unwrap_or(0.0);
        let deviations: Vec<f64> = frame.iter().map(|value| value - mean).collect();
        // The mean of equal numbers need not be that number: what is left would be noise over noise.
        let squares = if is_constant(frame) {
            0.0
        } else {
            sum_of(&deviations, &deviations, |x, _| x * x)
        };
        Self {
            deviations,
            squares,
        }
    }

    /// The same pixels in another order.
    pub(crate) fn permuted(&self, order: &[usize]) -> Self {
        Self {
            deviations: order.iter().map(|&index| self.deviations[index]).collect(),
            squares: self.squares,
        }
    }

    pub(crate) fn correlation(&self, other: &Self) -> Option<f64> {
        correlation_of(self.product(other), self.squares, other.squares)
    }

    pub(crate) fn slope_over(&self, claim: &Self) -> Option<f64> {
        let slope = (claim.squares > 0.0).then(|| self.product(claim) / claim.squares)?;
        finite(slope)
    }

    /// The slope where the other side, too, holds noise of `sigma_c` a pixel: its share of the squares is taken out. `None`
    /// where noise is half of what there is, or more.
    pub(crate) fn slope_over_noisy(&self, other: &Self, sigma_c: f64) -> Option<f64> {
        let noise = count(self.deviations.len().saturating_sub(1)) * sigma_c * sigma_c;
        (other.squares > 2.0 * noise).then(|| self.product(other) / (other.squares - noise))
    }

    fn product(&self, other: &Self) -> f64 {
        sum_of(&self.deviations, &other.deviations, |x, y| x * y)
    }
}

pub(crate) fn correlation_of(product: f64, squares: f64, other_squares: f64) -> Option<f64> {
    if squares <= 0.0 || other_squares <= 0.0 {
        return None;
    }
    finite((product / (squares.sqrt() * other_squares.sqrt())).clamp(-1.0, 1.0))
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
    finite(sum_of(values, values, |x, _| x) / count(values.len()))
}

/// Whether two frames can be compared at all.
pub(crate) fn comparable(real: &[f64], simulated: &[f64]) -> Option<()> {
    let defined = !real.is_empty()
        && real.len() == simulated.len()
        && all_finite(real)
        && all_finite(simulated);
    defined.then_some(())
}

/// Asked of every value, not up to the first that is not: that is what the processor does for several at once.
pub(crate) fn all_finite(frame: &[f64]) -> bool {
    frame
        .iter()
        .fold(true, |all, value| all & value.is_finite())
}

/// Lowest and highest value.
pub(crate) fn extremes(frame: &[f64]) -> (f64, f64) {
    let (whole, rest) = frame.split_at(frame.len() - frame.len() % LANES);
    let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    for chunk in whole.chunks_exact(LANES) {
        for lane in 0..LANES {
            low[lane] = if chunk[lane] < low[lane] {
                chunk[lane]
            } else {
                low[lane]
            };
            high[lane] = if chunk[lane] > high[lane] {
                chunk[lane]
            } else {
                high[lane]
            };
        }
    }
    (
        low.iter()
            .chain(rest)
            .copied()
            .fold(f64::INFINITY, f64::min),
        high.iter()
            .chain(rest)
            .copied()
            .fold(f64::NEG_INFINITY, f64::max),
    )
}

/// Sums that do not wait for one another.
const LANES: usize = 8;

/// The sum of a function of both values over all pixels, in an order that is the same on every machine.
pub(crate) fn sum_of(x: &[f64], y: &[f64], term: impl Fn(f64, f64) -> f64) -> f64 {
    let whole = x.len().min(y.len()) / LANES * LANES;
    let mut sums = [0.0; LANES];
    for (x, y) in x[..whole]
        .chunks_exact(LANES)
        .zip(y[..whole].chunks_exact(LANES))
    {
        for lane in 0..LANES {
            sums[lane] += term(x[lane], y[lane]);
        }
    }
    let rest: f64 = x[whole..]
        .iter()
        .zip(&y[whole..])
        .map(|(&x, &y)| term(x, y))
        .sum();
    sum_of_lanes(sums) + rest
}

/// Sums of the squares, of the absolute values and of the differences y less x, as [`sum_of`] makes them.
pub(crate) fn difference_sums(x: &[f64], y: &[f64]) -> [f64; 3] {
    let whole = x.len().min(y.len()) / LANES * LANES;
    let mut sums = [[0.0; LANES]; 3];
    for (x, y) in x[..whole]
        .chunks_exact(LANES)
        .zip(y[..whole].chunks_exact(LANES))
    {
        for lane in 0..LANES {
            let difference = y[lane] - x[lane];
            sums[0][lane] += difference * difference;
            sums[1][lane] += difference.abs();
            sums[2][lane] += difference;
        }
    }
    let mut rest = [0.0; 3];
    for difference in differences(&x[whole..], &y[whole..]) {
        rest[0] += difference * difference;
        rest[1] += difference.abs();
        rest[2] += difference;
    }
    std::array::from_fn(|index| sum_of_lanes(sums[index]) + rest[index])
}

fn sum_of_lanes([a, b, c, d, e, f, g, h]: [f64; LANES]) -> f64 {
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

pub(crate) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

pub(crate) fn is_constant(frame: &[f64]) -> bool {
    frame
        .iter()
        .skip(1)
        .fold(true, |all, &value| all & (value == frame[0]))
}

fn binned(
    real: &[f64],
    simulated: &[f64],
    binning: Binning,
) -> Option<(Binned, Binned, bins::Joint)> {
    comparable(real, simulated)?;
    let mut counter = Counter::new();
    let real = counter.binned(real, binning)?;
    let simulated = counter.binned(simulated, binning)?;
    let joint = counter.joint(&real, &simulated);
    Some((real, simulated, joint))
}

fn differences(real: &[f64], simulated: &[f64]) -> impl Iterator<Item = f64> {
    real.iter().zip(simulated).map(|(x, y)| y - x)
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

    /// By hand: two bins of two on either side. In step they are two pairs, 1 bit, and the bias is
    /// (2 + 2 - 2 - 1) / (2 * 4 ln 2) = 0.180337; crossed they are four pairs, 0 bits, and it is (2 + 2 - 4 - 1) / (8 ln 2).
    #[test]
    fn the_bias_of_few_pixels_is_taken_out_of_mutual_information() {
        let step = Binning::Step { width_c: 1.0 };
        let corrected = |real, simulated| mutual_information_corrected(real, simulated, step);
        close(
            corrected(&[1.0, 1.0, 2.0, 2.0], &[9.0, 9.0, 8.0, 8.0]),
            1.180_336_880_111,
        );
        close(
            corrected(&[1.0, 1.0, 2.0, 2.0], &[5.0, 6.0, 5.0, 6.0]),
            -0.180_336_880_111,
        );
    }

    /// By hand: differences of 3 and -4 are marked, the root of 25 / 2.
    #[test]
    fn the_foreground_is_what_the_mask_marks() {
        let (real, simulated) = ([20.0; 4], [23.0, 16.0, 20.0, 90.0]);
        let foreground = |mask: &[bool]| foreground_rmse(&real, &simulated, mask);
        close(foreground(&[true, true, false, false]), 3.535_533_905_933);
        assert_eq!(foreground(&[false; 4]), None);
        assert_eq!(foreground(&[true; 3]), None);
    }

    /// 1, -2, 3 … 11: squares add up to 506, absolute values to 66, the numbers to 6. Eleven are more than one round.
    #[test]
    fn sums_of_differences_take_in_what_is_left_of_a_round() {
        let x = [20.0; 11];
        let y: [f64; 11] = std::array::from_fn(|index| {
            let number = count(index + 1);
            20.0 + if index % 2 == 0 { number } else { -number }
        });
        assert_eq!(difference_sums(&x, &y), [506.0, 66.0, 6.0]);
        assert_eq!(sum_of(&x, &y, |x, y| y - x), 6.0);
        assert_eq!(extremes(&y), (10.0, 31.0));
        assert_eq!(extremes(&y[..2]), (18.0, 21.0));
    }

    /// By hand: products add up to 6, squares to 2; noise of 0.25 in five pixels is 4 / 16 of them, of 0.5 it is half.
    #[test]
    fn noise_on_the_other_side_does_not_flatten_the_slope() {
        let steep = Centred::new(&[23.0, 17.0, 20.0, 20.0, 20.0]);
        let noisy = Centred::new(&[1.0, -1.0, 0.0, 0.0, 0.0]);
        close(steep.slope_over_noisy(&noisy, 0.0), 3.0);
        close(steep.slope_over_noisy(&noisy, 0.25), 6.0 / 1.75);
        assert_eq!(steep.slope_over_noisy(&noisy, 0.5), None);
    }
}
