//! The static protocol, against the same sums written out pair by pair.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_validator::metrics;
use grideye_validator::{
    Measure, Protocol, RealFrame, Settings, Shape, SimulatedFrame, THREADS_MAX, compare,
};
use std::time::Duration;

const AMBIENT_C: f64 = 21.0;

/// Three warm pixels per side from `corner`, and a ripple that differs between frames.
fn frame(corner: usize, warm_c: f64, ripple: u32) -> Vec<f64> {
    (0..64_u32)
        .map(|index| {
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
        .collect()
}

/// The glossary's definition: over pixels warm in the mean of the real frames or in the claim, the pair's common offset
/// removed.
fn gain(real: &[RealFrame], simulated: &[SimulatedFrame], above_c: f64) -> f64 {
    let frames = f64::from(u32::try_from(real.len()).unwrap());
    let mean = |pixel: usize| real.iter().map(|frame| frame.celsius[pixel]).sum::<f64>() / frames;
    let (mut predicted, mut blank) = (0.0, 0.0);
    for real in real {
        for simulated in simulated {
            let claim = &simulated.noise_free;
            let mut apart: Vec<f64> = (0..64)
                .map(|pixel| real.celsius[pixel] - claim[pixel])
                .collect();
            apart.sort_by(f64::total_cmp);
            let offset = apart[16..48].iter().sum::<f64>() / 32.0;
            for (pixel, &claim) in claim.iter().enumerate() {
                let is_real = mean(pixel) - offset - AMBIENT_C > above_c;
                if is_real || claim - AMBIENT_C > above_c / 2.0 {
                    predicted += (real.celsius[pixel] - offset - simulated.celsius[pixel]).powi(2);
                    blank += (real.celsius[pixel] - offset - AMBIENT_C).powi(2);
                }
            }
        }
    }
    1.0 - (predicted / blank).sqrt()
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
            truth: None,
        })
        .to_vec();
    let shape = Shape {
        columns: 8,
        rows: 8,
    };
    for threads in [1, 2, THREADS_MAX] {
        let settings = Settings {
            threads,
            shuffles: 5,
            ..Settings::new(Protocol::Static, AMBIENT_C, 0.25)
        };
        let found = compare(shape, &real, &simulated, &settings).unwrap();
        assert_eq!(found.pairs, 12);
        let over_pairs = |score: &dyn Fn(&[f64], &[f64]) -> f64| {
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
        let expected = gain(&real, &simulated, found.union_above_c);
        let gain = value(Measure::Gain);
        assert!((gain - expected).abs() < 1e-12, "{gain} {expected}");
        assert!(gain > 0.0 && gain < 0.9, "{gain}");
    }
}
