//! The metrics against reference vectors and frames counted by hand.

use super::*;
use crate::metrics::distance::Centered;
use crate::numbers::{assert_near, count, difference_sums, extremes, sum_of};

/// The two frames of the reference vectors: 8 x 8, B is A with an uneven error and one pixel 2.5 degrees off.
fn reference_frames() -> (Vec<f64>, Vec<f64>) {
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for row in 0..8_u32 {
        for column in 0..8_u32 {
            let warm = (3..=4).contains(&row) && (2..=3).contains(&column);
            let real =
                23.5 + 0.25 * f64::from((3 * row + 5 * column) % 7) + if warm { 4.0 } else { 0.0 };
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
    assert_near(found.unwrap(), expected, 1e-9);
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
    for (threshold, share) in [(0.5, 0.0), (0.500_001, 1.0)] {
        let found = image_similarity(&[20.0, 20.0], &[20.5, 19.5], threshold);
        assert_eq!(found, Some(share), "{threshold}");
    }
    assert_eq!(image_similarity(&[20.0], &[20.0], 0.0), Some(0.0));
}

/// Two halves, and another frame that knows nothing of them.
const HALVES: [f64; 4] = [1.0, 1.0, 2.0, 2.0];
const CROSSED: [f64; 4] = [5.0, 6.0, 5.0, 6.0];

#[test]
fn entropies_of_frames_counted_by_hand() {
    let step = Binning::Step { width_c: 1.0 };
    assert_eq!(entropy(&[1.0, 2.0, 3.0, 4.0], step), Some(2.0));
    assert_eq!(entropy(&[1.0, 1.0, 2.0, 2.0], step), Some(1.0));
    assert_eq!(entropy(&[7.0; 5], step), Some(0.0));
    assert_eq!(entropy(&[7.0; 5], Binning::PaperGrey256), Some(0.0));
    assert_eq!(joint_entropy(&HALVES, &CROSSED, step), Some(2.0));
    let mutual = |other: &[f64; 4]| mutual_information(&HALVES, other, step);
    assert_eq!(mutual(&CROSSED), Some(0.0));
    assert_eq!(mutual(&[9.0, 9.0, 8.0, 8.0]), Some(1.0));
    let levels = |n| entropy(&[1.0, 2.0, 3.0], Binning::Levels { n });
    assert!(levels(2).unwrap() > 0.9);
    assert_eq!((levels(1), levels(0)), (Some(0.0), Some(0.0)));
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

/// By hand: in step 1 bit, bias 1 / (8 ln 2); crossed 0 bits, bias -1 / (8 ln 2).
#[test]
fn the_bias_of_few_pixels_is_taken_out_of_mutual_information() {
    let step = Binning::Step { width_c: 1.0 };
    let corrected = |other: &[f64; 4]| mutual_information_corrected(&HALVES, other, step);
    close(corrected(&[9.0, 9.0, 8.0, 8.0]), 1.180_336_880_111);
    close(corrected(&CROSSED), -0.180_336_880_111);
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
    let steep = Centered::new(&[23.0, 17.0, 20.0, 20.0, 20.0]);
    let noisy = Centered::new(&[1.0, -1.0, 0.0, 0.0, 0.0]);
    close(steep.slope_over_noisy(&noisy, 0.0), 3.0);
    close(steep.slope_over_noisy(&noisy, 0.25), 6.0 / 1.75);
    assert_eq!(steep.slope_over_noisy(&noisy, 0.5), None);
}
