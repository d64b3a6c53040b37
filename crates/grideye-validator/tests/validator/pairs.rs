//! The static protocol, against the same sums written out pair by pair.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use crate::toy::pair;
use grideye_validator::metrics;
use grideye_validator::{Measure, Protocol, RealFrame, Settings, SimulatedFrame, compare};
use std::time::Duration;

const AMBIENT_C: f64 = 21.0;

/// Three warm pixels per side from `corner`, and a ripple that differs between frames.
fn frame(corner: usize, warm_c: f64, ripple: u32) -> [f64; 64] {
    std::array::from_fn(|index| {
        let index = u32::try_from(index).unwrap();
        let (row, column) = (index / 8, index % 8);
        let corner = u32::try_from(corner).unwrap();
        let inside = |place: u32| (corner..corner + 3).contains(&place);
        let warm = if inside(row) && inside(column) {
            warm_c
        } else {
            0.0
        };
        let wave = f64::from((index * (7 + ripple) + 3 * ripple) % 11) - 5.0;
        AMBIENT_C + warm + 0.03 * wave
    })
}

#[test]
fn every_real_frame_meets_every_simulated_one() {
    let real: Vec<RealFrame> = (0..3)
        .map(|index| RealFrame {
            time: Duration::from_millis(100 * u64::from(index)),
            celsius: frame(2, 3.0, index),
            later: Some(frame(2, 3.0, index + 1)),
        })
        .collect();
    // Claims that change and come back, and a shared one.
    let simulated: Vec<SimulatedFrame> = [(2, 4), (4, 5), (2, 6), (2, 7)]
        .map(|(corner, ripple)| SimulatedFrame {
            time: Duration::ZERO,
            celsius: frame(corner, 2.5, ripple),
            noise_free: frame(corner, 2.5, 0),
        })
        .to_vec();
    let settings = Settings {
        shuffles: 5,
        ..Settings::new(Protocol::Static, AMBIENT_C, 0.25)
    };
    let found = compare(&real, &simulated, &settings).unwrap();
    assert_eq!(found.pairs, 12);
    let over_pairs = |score: &dyn Fn(&[f64; 64], &[f64; 64]) -> f64| {
        let pairs = real.iter().flat_map(|real| {
            simulated
                .iter()
                .map(|simulated| score(&real.celsius, &simulated.celsius))
        });
        pairs.sum::<f64>() / 12.0
    };
    let value = |measure| found.score(measure).value.unwrap();
    let mean = over_pairs(&|x, y| metrics::correlation(x, y).unwrap());
    assert!((value(Measure::Correlation) - mean).abs() < 1e-12);
    let mean = over_pairs(&|x, y| metrics::rmse(x, y).unwrap());
    assert!((value(Measure::Rmse) - mean).abs() < 1e-12);
    for (&threshold, share) in found
        .evaluation
        .thresholds_c
        .iter()
        .zip(&found.evaluation.simulated)
    {
        let mean = over_pairs(&|x, y| metrics::image_similarity(x, y, threshold).unwrap());
        assert!((share - mean).abs() < 1e-12, "{threshold}: {share} {mean}");
    }
    for measure in [Measure::JointEntropy, Measure::MutualInformation] {
        let of_one = |x: &_, y: &_| pair(x, y).unwrap().score(measure).value.unwrap();
        assert!((value(measure) - over_pairs(&of_one)).abs() < 1e-12);
    }
    // The claims' blobs lie two pixels off in both directions in one of four, and right in the others.
    let apart = value(Measure::CentroidError);
    assert!((apart - 8.0_f64.sqrt() / 4.0).abs() < 0.1, "{apart}");
}
