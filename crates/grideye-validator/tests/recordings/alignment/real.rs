//! Aligns a real recording with itself.

use crate::alignment::bench::with;
use grideye_recording::linaige;
use grideye_validator::align::{TimeAlignment, TimeFound, align_series};

/// Rows 0 to 1054 of session 3 of LINAIGE (`recordings/linaige/SOURCE.md`): the even frames are the film, the odd ones
/// the recording, delayed and resampled. Both have a real sensor's noise, but different noise.
#[test]
fn a_real_recording_is_aligned_with_itself() {
    let frames = session_3();
    let (film, real) = (half(&frames, 0), half(&frames, 1));
    println!("\nLINAIGE session 3, rows 0 to 1054; film: even rows, recording: odd rows");
    println!(
        "{:>8}{:>8}{:>12}{:>12}{:>10}{:>10}",
        "shift", "rate", "shift found", "rate found", "likeness", "chance"
    );
    for (shift_s, rate) in [
        (0.0, 0.0),
        (0.25, 0.0),
        (-0.4, 0.0),
        (0.0, 0.04),
        (0.3, -0.05),
        (2.0, 0.03),
    ] {
        real_delay_is_found(&film, &real, shift_s, rate);
    }
    // A minute later in the same room the person takes other steps: nothing to align.
    let (later_s, later): (Vec<f64>, Vec<[f64; 64]>) = real
        .0
        .iter()
        .zip(real.1.iter().skip(real.1.len() / 2))
        .map(|(time_s, celsius)| (*time_s, *celsius))
        .unzip();
    let found = films_aligned(&film, &(later_s, later));
    println!(
        "half the recording later: likeness {:.3}, chance {:.3}, applied {}",
        found.likeness,
        found.chance.unwrap(),
        found.applied
    );
    assert!(!found.applied, "{found:?}");
}

/// Times in seconds, and their frames.
type Film = (Vec<f64>, Vec<[f64; 64]>);

fn session_3() -> Vec<(f64, [f64; 64])> {
    let name = "Session3_2021-07-06_RoomA_v2.csv";
    let path = format!(
        "{}/../../recordings/linaige/{name}",
        env!("CARGO_MANIFEST_DIR")
    );
    linaige::Reader::new(
        std::fs::File::open(path).unwrap(),
        linaige::Date::from_file_name(name).unwrap(),
        linaige::stream_from_file_name(name),
    )
    .unwrap()
    .take(1055)
    .filter_map(|row| {
        let record = row.unwrap().row.record;
        let pixels = record.reading.frame()?.pixels;
        let celsius = pixels.map(|word| f64::from(word.0 & 0xFFF) * 0.25);
        Some((record.stamp.t_boot_ns as f64 / 1e9, celsius))
    })
    .collect()
}

fn half(frames: &[(f64, [f64; 64])], first: usize) -> Film {
    let first_s = frames[0].0;
    frames
        .iter()
        .skip(first)
        .step_by(2)
        .map(|(time_s, celsius)| (time_s - first_s, *celsius))
        .unzip()
}

fn films_aligned(film: &Film, recording: &Film) -> TimeFound {
    align_series(
        (&film.0, &film.1),
        (&recording.0, &recording.1),
        &with(TimeAlignment::Rate, 3.0),
    )
    .unwrap()
    .unwrap()
}

fn real_delay_is_found(film: &Film, (real_s, real): &Film, shift_s: f64, rate: f64) {
    // The recording's clock fulfills scene = t + shift + rate * (t - origin), with the origin at its first frame.
    let origin_s = real_s[0];
    let times_s: Vec<f64> = real_s
        .iter()
        .map(|scene_s| (scene_s - shift_s + rate * origin_s) / (1.0 + rate))
        .collect();
    // The shift counts at the recording's first frame, which is not at the origin.
    let expected_s = shift_s + rate * (times_s[0] - origin_s);
    let found = films_aligned(film, &(times_s, real.clone()));
    println!(
        "{shift_s:>8.2}{rate:>8.3}{:>12.4}{:>12.5}{:>10.3}{:>10.3}",
        found.shift_s,
        found.rate,
        found.likeness,
        found.chance.unwrap()
    );
    assert!(found.applied);
    assert!(
        (found.shift_s - expected_s).abs() < 0.05,
        "{expected_s} {found:?}"
    );
    assert!((found.rate - rate).abs() < 0.001, "{found:?}");
}
