//! Every measure of the validator against NumPy, SciPy, scikit-learn and scikit-image, on real frames of two rooms and on
//! the reference vectors.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{root, run};
use grideye_tests::python::peer;
use grideye_validator::metrics::Blob;
use grideye_validator::{
    Comparison, Measure, Protocol, RealFrame, Settings, SimulatedFrame, compare,
};
use serde_json::{Value, json};
use std::hint::black_box;
use std::time::{Duration, Instant};

const COLUMNS: usize = 8;
const AMBIENT_C: f64 = 25.0;
const WARM_ABOVE_C: f64 = 1.0;

type Frame = [f64; 64];

/// The pixels of a LINAIGE session, column by column of the file; nothing of this project reads it.
fn session(name: &str) -> Vec<Frame> {
    let path = root().join("recordings/linaige").join(name);
    let text = std::fs::read_to_string(path).unwrap();
    let frame = |line: &str| -> Frame {
        let cells: Vec<f64> = line
            .split(',')
            .skip(2)
            .take(64)
            .map(|cell| cell.parse().unwrap())
            .collect();
        cells.try_into().unwrap()
    };
    text.lines().skip(1).map(frame).collect()
}

/// A of the reference vectors beside its B.
fn reference_vectors() -> (Frame, Frame) {
    let place = |index: usize| (index / 8, index % 8);
    let number = |value: usize| f64::from(u32::try_from(value).unwrap());
    let a: Frame = std::array::from_fn(|index| {
        let (r, c) = place(index);
        let warm = (3..=4).contains(&r) && (2..=3).contains(&c);
        23.5 + 0.25 * number((3 * r + 5 * c) % 7) + if warm { 4.0 } else { 0.0 }
    });
    let b: Frame = std::array::from_fn(|index| {
        let (r, c) = place(index);
        let spike = if (r, c) == (3, 4) { 2.5 } else { 0.0 };
        let value: f64 = a[index] + 0.11 * number((r * c) % 13) - 0.4 + spike;
        (value * 100.0).round() / 100.0
    });
    (a, b)
}

/// Real frames with others some time later, with one turned, with a flat one and with one off the sensor's steps.
fn pairs() -> Vec<(Frame, Frame)> {
    let mut pairs = vec![reference_vectors()];
    for name in [
        "Session2_2021-07-01_RoomB_v2.csv",
        "Session3_2021-07-06_RoomA_v2.csv",
    ] {
        let frames = session(name);
        for index in (0..frames.len() - 50).step_by(40) {
            pairs.push((frames[index], frames[index + 3]));
            pairs.push((frames[index], frames[index + 50]));
        }
        let mut turned = frames[100];
        turned.reverse();
        pairs.push((frames[100], turned));
        pairs.push((frames[200], [AMBIENT_C; 64]));
        pairs.push((
            frames[300],
            frames[300].map(|celsius| celsius * 1.01 + 0.003),
        ));
    }
    pairs
}

fn compared(x: &Frame, y: &Frame) -> Comparison {
    let time = Duration::ZERO;
    let real = RealFrame {
        time,
        celsius: *x,
        later: None,
    };
    let simulated = SimulatedFrame {
        time,
        celsius: *y,
        noise_free: *y,
    };
    let settings = Settings {
        shuffles: 1,
        ..Settings::new(Protocol::Static, AMBIENT_C, 0.25)
    };
    compare(&[real], &[simulated], &settings).unwrap()
}

fn ours(x: &Frame, y: &Frame) -> Value {
    let found = compared(x, y);
    let of = |measure| found.score(measure).value;
    let mut figures = json!({
        "correlation": of(Measure::Correlation),
        "image_similarity": of(Measure::ImageSimilarity),
        "evaluation_graph": found.evaluation.simulated,
        "rmse": of(Measure::Rmse),
        "bias": of(Measure::Bias),
        "entropy_real": of(Measure::EntropyReal),
        "entropy_simulated": of(Measure::EntropySimulated),
        "joint_entropy": of(Measure::JointEntropy),
        "mutual_information": of(Measure::MutualInformation),
    });
    let [real, simulated] = [x, y].map(|frame| Blob::find(frame, WARM_ABOVE_C));
    let apart = real.zip(simulated).map(|(a, b)| a.distance_pixels(&b));
    figures["centroid_error_pixels"] = json!(apart);
    figures
}

/// What one pair costs here, best of several rounds.
fn nanoseconds(pairs: &[(Frame, Frame)]) -> f64 {
    let round = || {
        let start = Instant::now();
        for (x, y) in pairs {
            black_box(ours(black_box(x), black_box(y)));
        }
        start.elapsed()
    };
    let fastest = (0..10).map(|_| round()).min().unwrap();
    fastest.as_secs_f64() * 1e9 / f64::from(u32::try_from(pairs.len()).unwrap())
}

#[test]
fn every_measure_is_what_other_programs_make_of_the_same_frames() {
    let pairs = pairs();
    let folder = tempfile::tempdir().unwrap();
    let entry = |(x, y): &(Frame, Frame)| json!({ "real": x.to_vec(), "simulated": y.to_vec(), "ours": ours(x, y) });
    let figures = json!({
        "columns": COLUMNS,
        "rows": 8,
        "warm_above_c": WARM_ABOVE_C,
        "nanoseconds": nanoseconds(&pairs),
        "pairs": pairs.iter().map(entry).collect::<Vec<_>>(),
    });
    let file = folder.path().join("figures.json");
    std::fs::write(&file, figures.to_string()).unwrap();
    let what = "our measures against SciPy, scikit-learn and scikit-image";
    let Some(mut script) = peer("metrics.py", &[file.to_str().unwrap()], what) else {
        return;
    };
    let ended = run(&mut script);
    println!("{}", ended.stdout);
    assert_eq!(ended.code, 0, "{ended:?}");
}
