//! Properties of the metrics and of whole comparisons, on random frames.

use crate::toy::{pair, settings};
use grideye_validator::metrics::{bias, correlation, image_similarity, rmse};
use grideye_validator::{Measure, Protocol, RealFrame, SimulatedFrame, compare};
use proptest::prelude::*;
use std::collections::HashMap;
use std::time::Duration;

/// Sensor values, or any finite number.
fn pixel() -> impl Strategy<Value = f64> {
    prop_oneof![
        (60_i32..140).prop_map(|word| f64::from(word) * 0.25),
        Just(20.0),
        proptest::num::f64::NORMAL,
        proptest::num::f64::ZERO | proptest::num::f64::SUBNORMAL,
    ]
}

fn sensor_frame() -> impl Strategy<Value = [f64; 64]> {
    let pixel = (60_i32..140).prop_map(|word| f64::from(word) * 0.25);
    proptest::collection::vec(pixel, 64).prop_map(|frame| frame.try_into().unwrap())
}

fn score(x: &[f64; 64], y: &[f64; 64], measure: Measure) -> f64 {
    let found = pair(x, y).unwrap();
    found.score(measure).value.unwrap()
}

fn mutual_information(x: &[f64; 64], y: &[f64; 64]) -> f64 {
    score(x, y, Measure::MutualInformation)
}

fn entropy(x: &[f64; 64]) -> f64 {
    score(x, x, Measure::EntropyReal)
}

fn frames() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    (1_usize..80).prop_flat_map(|n| {
        (
            proptest::collection::vec(pixel(), n),
            proptest::collection::vec(pixel(), n),
        )
    })
}

/// Pearson as `(var(x/sx + y/sy) / 2) - 1`, which shares no step with the covariance of deviations.
fn correlation_by_variance_of_sums(x: &[f64], y: &[f64]) -> f64 {
    let n = f64::from(u32::try_from(x.len()).unwrap());
    let variance = |v: &[f64]| {
        let mean = v.iter().sum::<f64>() / n;
        v.iter().map(|a| a * a).sum::<f64>() / n - mean * mean
    };
    let (sx, sy) = (variance(x).sqrt(), variance(y).sqrt());
    let sums: Vec<f64> = x.iter().zip(y).map(|(a, b)| a / sx + b / sy).collect();
    variance(&sums) / 2.0 - 1.0
}

/// Mutual information as `sum p(x, y) log2(p(x, y) / (p(x) p(y)))`, with counts in a map.
fn information_by_divergence(x: &[f64], y: &[f64]) -> f64 {
    let keys = |frame: &[f64]| -> Vec<String> {
        let low = frame.iter().copied().fold(f64::INFINITY, f64::min);
        let high = frame.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let level = |value: &f64| (255.0 * (value - low) / (high - low).max(1e-9)).round();
        frame
            .iter()
            .map(|value| format!("{:.0}", level(value)))
            .collect()
    };
    let n = f64::from(u32::try_from(x.len()).unwrap());
    let (mut px, mut py, mut pxy) = (HashMap::new(), HashMap::new(), HashMap::new());
    for (a, b) in keys(x).into_iter().zip(keys(y)) {
        *px.entry(a.clone()).or_insert(0.0) += 1.0 / n;
        *py.entry(b.clone()).or_insert(0.0) += 1.0 / n;
        *pxy.entry((a, b)).or_insert(0.0) += 1.0 / n;
    }
    pxy.iter()
        .map(|((a, b), p): (_, &f64)| p * (p / (px[a] * py[b])).log2())
        .sum()
}

proptest! {
    #[test]
    fn no_metric_is_ever_nan((x, y) in frames(), threshold in proptest::num::f64::ANY) {
        let answers = [correlation(&x, &y), rmse(&x, &y), bias(&x, &y), image_similarity(&x, &y, threshold)];
        prop_assert!(answers.iter().flatten().all(|value| value.is_finite()), "{answers:?}");
        if let Some(c) = correlation(&x, &y) {
            prop_assert!((-1.0..=1.0).contains(&c));
        }
    }

    #[test]
    fn correlation_agrees_with_the_variance_of_sums(x in sensor_frame(), y in sensor_frame()) {
        let c = correlation(&x, &y).unwrap();
        prop_assert!((c - correlation_by_variance_of_sums(&x, &y)).abs() < 1e-9);
        prop_assert!((c - correlation(&y, &x).unwrap()).abs() < 1e-12);
    }

    #[test]
    fn information_agrees_with_its_other_definition(x in sensor_frame(), y in sensor_frame()) {
        let information = mutual_information(&x, &y);
        prop_assert!((information - information_by_divergence(&x, &y)).abs() < 1e-9);
    }

    #[test]
    fn information_is_symmetric_and_with_oneself_is_entropy(x in sensor_frame(), y in sensor_frame()) {
        let information = mutual_information;
        prop_assert!((information(&x, &y) - information(&y, &x)).abs() < 1e-12);
        prop_assert!((information(&x, &x) - entropy(&x)).abs() < 1e-12);
        prop_assert!(information(&x, &y) <= entropy(&x) + 1e-12);
    }

    #[test]
    fn order_of_the_pixels_leaves_entropy_alone(x in sensor_frame(), order in Just((0..64_usize).collect::<Vec<_>>()).prop_shuffle()) {
        let shuffled: [f64; 64] = std::array::from_fn(|index| x[order[index]]);
        prop_assert_eq!(entropy(&x), entropy(&shuffled));
    }

    #[test]
    fn rmse_splits_into_bias_and_spread(x in sensor_frame(), y in sensor_frame()) {
        let (rmse, bias) = (rmse(&x, &y).unwrap(), bias(&x, &y).unwrap());
        prop_assert!(bias.abs() <= rmse + 1e-12);
        let leveled: Vec<f64> = y.iter().map(|value| value + bias).collect();
        let spread = grideye_validator::metrics::rmse(&x, &leveled).unwrap();
        prop_assert!((rmse - bias.hypot(spread)).abs() < 1e-9);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn no_comparison_of_any_frames_holds_nan(
        sides in proptest::collection::vec((sensor_frame(), sensor_frame(), sensor_frame()), 1..4),
        protocol in prop_oneof![Just(Protocol::Static), Just(Protocol::Dynamic)],
    ) {
        let time = Duration::ZERO;
        let (real, simulated): (Vec<_>, Vec<_>) = sides
            .into_iter()
            .map(|(celsius, later, noise_free)| {
                let simulated = SimulatedFrame { time, celsius: later, noise_free };
                (RealFrame { time, celsius, later: Some(later) }, simulated)
            })
            .unzip();
        let comparison = compare(&real, &simulated, &settings(protocol)).unwrap();
        for score in comparison.scores.iter() {
            let shuffled = score.shuffled.map_or([None; 2], |shuffled| [Some(shuffled.mean), Some(shuffled.p95)]);
            let values = [score.value, score.blank, score.ceiling, score.skill(), shuffled[0], shuffled[1]];
            prop_assert!(values.iter().flatten().all(|value| value.is_finite()), "{score:?}");
        }
    }
}
