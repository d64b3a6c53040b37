//! The metrics against reference vectors and frames counted by hand.

use crate::toy::pair;
use grideye_validator::Measure;
use grideye_validator::metrics::{
    IS_THRESHOLD, THRESHOLDS, bias, correlation, image_similarity, rmse, thresholds_c,
};
use proptest::prelude::*;

/// The two 8 x 8 reference frames: B is A with an uneven error and one pixel 2.5 degrees off.
fn reference_frames() -> ([f64; 64], [f64; 64]) {
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
    (a.try_into().unwrap(), b.try_into().unwrap())
}

/// Four values, each in a quarter of the pixels.
fn quarters(values: [f64; 4]) -> [f64; 64] {
    std::array::from_fn(|pixel| values[pixel % 4])
}

fn graph(real: &[f64; 64], simulated: &[f64; 64]) -> Vec<f64> {
    let found = pair(real, simulated).unwrap();
    found.evaluation.simulated
}

/// Entropies of both frames, the joint one, and the mutual information.
fn bits(real: &[f64; 64], simulated: &[f64; 64]) -> [Option<f64>; 4] {
    let found = pair(real, simulated).unwrap();
    [
        Measure::EntropyReal,
        Measure::EntropySimulated,
        Measure::JointEntropy,
        Measure::MutualInformation,
    ]
    .map(|measure| found.score(measure).value)
}

#[track_caller]
fn close(found: Option<f64>, expected: f64) {
    let found = found.unwrap();
    assert!((found - expected).abs() < 1e-9, "{found}, not {expected}");
}

#[test]
fn distances_of_the_reference_vectors() {
    let (a, b) = reference_frames();
    close(correlation(&a, &b), 0.895_076_526_669);
    close(rmse(&a, &b), 0.613_739_817);
    close(bias(&a, &b), -0.159_843_75);
}

#[test]
fn similarity_of_the_reference_vectors() {
    let (a, b) = reference_frames();
    let shares = [0.25, 0.5, 1.66].map(|threshold| image_similarity(&a, &b, threshold));
    assert_eq!(shares, [0.3125, 0.781_25, 0.984_375].map(Some));
    let graph = graph(&a, &b);
    assert_eq!((graph[5], graph[10]), (0.3125, 0.781_25));
    close(image_similarity(&a, &b, IS_THRESHOLD), 0.984_375);
    assert!((IS_THRESHOLD - 1.666_666_666_666_666_7).abs() < 1e-15);
}

#[test]
fn entropies_of_the_reference_vectors_in_grey_levels() {
    let (a, b) = reference_frames();
    let [own, other, joint, mutual] = bits(&a, &b);
    close(own, 3.089_407_329);
    close(other, 5.452_819_531);
    close(joint, 5.527_114_648);
    close(mutual, 3.015_112_211);
}

#[test]
fn a_difference_equal_to_the_threshold_does_not_count() {
    for (threshold, share) in [(0.5, 0.0), (0.500_001, 1.0)] {
        let found = image_similarity(&[20.0, 20.0], &[20.5, 19.5], threshold);
        assert_eq!(found, Some(share), "{threshold}");
    }
    assert_eq!(image_similarity(&[20.0], &[20.0], 0.0), Some(0.0));
}

/// Two halves, and a frame independent of them.
const HALVES: [f64; 4] = [1.0, 1.0, 2.0, 2.0];
const CROSSED: [f64; 4] = [5.0, 6.0, 5.0, 6.0];

#[test]
fn entropies_of_frames_counted_by_hand() {
    let of = |values: [f64; 4]| {
        let frame = quarters(values);
        bits(&frame, &frame)[0]
    };
    assert_eq!(of([1.0, 2.0, 3.0, 4.0]), Some(2.0));
    assert_eq!(of(HALVES), Some(1.0));
    assert_eq!(of([7.0; 4]), Some(0.0));
    // 256 levels from 0 to 255 °C: values less than half a degree apart may share one.
    assert_eq!(of([0.0, 0.4, 254.6, 255.0]), Some(1.0));
    let with_halves = |other| bits(&quarters(HALVES), &quarters(other));
    assert_eq!(with_halves(CROSSED)[2..], [Some(2.0), Some(0.0)]);
    assert_eq!(with_halves([9.0, 9.0, 8.0, 8.0])[3], Some(1.0));
}

#[test]
fn zero_is_one_bin_whatever_its_sign() {
    let frame = quarters([-0.0, 0.0, 1.0, 1.0]);
    assert_eq!(bits(&frame, &frame)[0], Some(1.0));
}

#[test]
fn undefined_measures_are_none() {
    let flat = [20.0; 4];
    let slope = [20.0, 21.0, 22.0, 23.0];
    assert_eq!(correlation(&flat, &slope), None);
    assert_eq!(correlation(&slope, &flat), None);
    assert_eq!(correlation(&[], &[]), None);
    assert_eq!(rmse(&slope, &slope[..3]), None);
    assert_eq!(rmse(&[f64::NAN], &[1.0]), None);
    assert_eq!(bias(&[1.0], &[f64::INFINITY]), None);
}

/// A constant frame with a mean that is not a machine number must not correlate rounding.
#[test]
fn a_constant_frame_of_an_odd_value_has_no_correlation() {
    assert_eq!(correlation(&[0.1; 64], &[20.3; 64]), None);
}

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
    fn the_graph_has_the_similarity_at_each_threshold((x, y) in (frame(), frame())) {
        let graph = graph(&x, &y);
        for (share, threshold) in graph.into_iter().zip(thresholds_c()) {
            prop_assert_eq!(Some(share), image_similarity(&x, &y, threshold), "{}", threshold);
        }
    }
}

/// Differences of exactly a threshold, slightly more or less, beyond the last, and none.
#[test]
fn differences_at_a_threshold_fall_on_its_far_side() {
    // The first threshold that all pixels are below.
    let place = |difference: f64| {
        let graph = graph(&[0.0; 64], &[difference; 64]);
        assert!(graph.iter().all(|share| [0.0, 1.0].contains(share)));
        graph.partition_point(|share| *share < 1.0)
    };
    for (index, threshold) in thresholds_c().into_iter().enumerate() {
        assert_eq!(place(threshold), index + 1);
        assert_eq!(place(-threshold), index + 1);
        assert_eq!(place(threshold.next_up()), index + 1);
        if index > 0 {
            assert_eq!(place(threshold.next_down()), index);
            // Between two thresholds, and where the nearest one changes.
            for part in [0.25, 0.5, 0.75] {
                assert_eq!(place(threshold - part / 20.0), index);
            }
        }
    }
    assert_eq!([5.02, 5.03, f64::MAX].map(place), [THRESHOLDS; 3]);
    let similar = |difference: f64| image_similarity(&[0.0; 64], &[difference; 64], IS_THRESHOLD);
    assert_eq!(similar(IS_THRESHOLD), Some(0.0));
    assert_eq!(similar(IS_THRESHOLD.next_down()), Some(1.0));
}
