//! Every measure of the validator against NumPy, SciPy, scikit-learn and scikit-image, on real frames of two rooms and on
//! the reference vectors.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{root, run};
use grideye_tests::python::peer;
use grideye_validator::metrics::{self, Binning, Blob, IS_THRESHOLD, Scorer};
use serde_json::{Value, json};
use std::hint::black_box;
use std::time::Instant;

const COLUMNS: usize = 8;
const AMBIENT_C: f64 = 25.0;
const SIGMA_C: f64 = 0.33;
const WARM_ABOVE_C: f64 = 1.0;
const FIELD_OF_VIEW_RAD: [f64; 2] = [std::f64::consts::FRAC_PI_3; 2];

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

fn ours(x: &Frame, y: &Frame, mask: &[bool], chosen: Binning) -> Value {
    let mut figures = json!({
        "correlation": metrics::correlation(x, y),
        "image_similarity": metrics::image_similarity(x, y, IS_THRESHOLD),
        "evaluation_graph": metrics::evaluation_graph(x, y, &metrics::thresholds_c()),
        "rmse": metrics::rmse(x, y),
        "mae": metrics::mae(x, y),
        "bias": metrics::bias(x, y),
        "foreground_rmse": metrics::foreground_rmse(x, y, mask),
        "contrast_slope": metrics::contrast_slope(x, y),
        "structural_similarity": metrics::structural_similarity(x, y, COLUMNS, AMBIENT_C),
        "structure_map": metrics::structure_map(x, y, COLUMNS, AMBIENT_C),
    });
    for (name, binning) in [("grey", Binning::PaperGrey256), ("binned", chosen)] {
        let corrected = metrics::mutual_information_corrected(x, y, binning);
        figures[format!("entropy_real_{name}")] = json!(metrics::entropy(x, binning));
        figures[format!("entropy_simulated_{name}")] = json!(metrics::entropy(y, binning));
        figures[format!("joint_entropy_{name}")] = json!(metrics::joint_entropy(x, y, binning));
        figures[format!("mutual_information_{name}")] =
            json!(metrics::mutual_information(x, y, binning));
        figures[format!("mutual_information_{name}_corrected")] = json!(corrected);
    }
    let warm = [x, y].map(|frame| metrics::warm(frame, WARM_ABOVE_C));
    figures["warm_overlap"] = json!(metrics::overlap(&warm[0], &warm[1]));
    let [real, simulated] = [x, y].map(|frame| Blob::find(frame, COLUMNS, WARM_ABOVE_C));
    let blobs = real.zip(simulated);
    let angle =
        |(a, b): &(Blob, Blob)| metrics::angle_between(a, b, (COLUMNS, 8), FIELD_OF_VIEW_RAD);
    figures["centroid_error_pixels"] = json!(blobs.map(|(a, b)| a.distance_pixels(&b)));
    figures["centroid_error_degrees"] = json!(blobs.as_ref().and_then(angle));
    let chi = metrics::chi_squared(x, y, SIGMA_C);
    figures["chi_squared"] = json!(chi.map(|chi| chi.value));
    figures["chi_squared_p"] = json!(chi.and_then(|chi| chi.p_value()));
    figures
}

/// What one pair costs here, best of several rounds.
fn nanoseconds(pairs: &[(Frame, Frame)]) -> f64 {
    let mut scorer = Scorer::new();
    let mut round = || {
        let start = Instant::now();
        for (x, y) in pairs {
            black_box(scorer.score(black_box(x), black_box(y), Binning::PaperGrey256));
        }
        start.elapsed()
    };
    let fastest = (0..50).map(|_| round()).min().unwrap();
    fastest.as_secs_f64() * 1e9 / f64::from(u32::try_from(pairs.len()).unwrap())
}

#[test]
fn every_measure_is_what_other_programs_make_of_the_same_frames() {
    let pairs = pairs();
    let folder = tempfile::tempdir().unwrap();
    for chosen in [
        Binning::Step { width_c: 0.25 },
        Binning::Step { width_c: 0.1 },
        Binning::Levels { n: 12 },
    ] {
        let entry = |(index, (x, y)): (usize, &(Frame, Frame))| {
            // Any mask will do: the pixels that are warm in the second frame, and none of every tenth.
            let mut mask = metrics::warm(y, 0.5);
            mask.iter_mut().for_each(|pixel| *pixel &= index % 10 != 9);
            let ours = ours(x, y, &mask, chosen);
            json!({ "real": x.to_vec(), "simulated": y.to_vec(), "mask": mask, "ours": ours })
        };
        let figures = json!({
            "columns": COLUMNS,
            "rows": 8,
            "binning": chosen.to_string(),
            "ambient_c": AMBIENT_C,
            "sigma_c": SIGMA_C,
            "warm_above_c": WARM_ABOVE_C,
            "field_of_view_rad": FIELD_OF_VIEW_RAD,
            "nanoseconds": nanoseconds(&pairs),
            "pairs": pairs.iter().enumerate().map(entry).collect::<Vec<_>>(),
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
}
