//! A thinned recording must score like the whole, and the borders of its runs must not count as faults.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_frame::{Celsius, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::{Scene, Simulator};
use grideye_validator::{
    Comparison, LeftOut, Measure, Options, RECORDS_MAX, Thinning, Verdict, compare_scene,
};
use std::io;
use std::time::Duration;

const SENSOR: &str = "ceiling";
/// Three times the limit, so that a quarter is kept.
const ROWS: u64 = 3 * 20_000 + 500;

/// Experiment 3's room, where the person walks back and forth for an hour and three quarters at alternating speeds.
fn scene() -> Scene {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../scenes/experiment-3.toml"
    );
    let text = std::fs::read_to_string(path).unwrap();
    let turns = (0..700).map(|turn| {
        let (from_y, to_y) = (1000 + 37 * (turn % 11), 1700 - 23 * (turn % 13));
        format!("300,{from_y},0\n2800,{to_y},0\n")
    });
    let way = format!("x_mm,y_mm,z_mm\n{}", turns.collect::<String>());
    let files = |_: &str| -> io::Result<String> { Ok(way.clone()) };
    Scene::parse(&text, "long.toml", &files).unwrap().scene
}

fn record(scene: &Scene, rows: u64) -> Vec<Record> {
    let simulator = Simulator::new(scene, SENSOR).unwrap();
    let row = |seq: u64| {
        let time = Duration::from_millis(100 * seq);
        let frame = simulator.noisy(time, 3).to_frame(Celsius::new(25.0));
        let stamp = Stamp {
            t_boot_ns: 1_000_000_000 + 100_000_000 * seq,
            t_utc_ns: 0,
            clock: ClockState::Synced,
        };
        let pixels = frame
            .unwrap()
            .pixels
            .map(|pixel| grideye_frame::word::pixel_word(pixel).unwrap());
        let thermistor = ThermistorWord(400);
        Record {
            seq,
            stamp,
            reading: Reading::Frame(RecordedFrame {
                thermistor: Some(thermistor),
                pixels,
            }),
        }
    };
    (0..rows).map(row).collect()
}

fn compared(records: &[Record], scene: &Scene) -> Comparison {
    let options = Options {
        seed: 5,
        frames: Some(1_000),
        shuffles: 20,
        ..Options::default()
    };
    compare_scene(records, scene, SENSOR, &options).unwrap()
}

#[test]
fn a_thinned_recording_scores_like_the_whole() {
    let scene = scene();
    assert!(scene.duration().as_secs() > 6_500, "{:?}", scene.duration());
    let all = record(&scene, ROWS);
    let mut thinning = Thinning::default();
    thinning.extend(all.iter().copied());
    let kept = thinning.finish();
    assert!(kept.records.len() <= RECORDS_MAX && kept.records.len() > RECORDS_MAX / 2);

    let (whole, thinned) = (compared(&all, &scene), compared(&kept.records, &scene));
    println!(
        "{:<40}{:>12}{:>12}{:>12}",
        "score",
        format!("{} rows", all.len()),
        format!("{} kept", kept.records.len()),
        "difference"
    );
    for score in whole.scores.iter() {
        let of = |comparison: &Comparison| comparison.score(score.measure).value;
        let (Some(whole), Some(thinned)) = (of(&whole), of(&thinned)) else {
            assert_eq!(of(&whole), of(&thinned), "{}", score.measure);
            continue;
        };
        let difference = thinned - whole;
        println!(
            "{:<40}{whole:>12.4}{thinned:>12.4}{difference:>12.4}",
            score.measure.name()
        );
    }
    for one in [&thinned, &whole] {
        let judgment = &one.judgment;
        assert_eq!(judgment.verdict, Verdict::Agrees, "{judgment}");
    }
    for (measure, slack) in [
        (Measure::Correlation, 0.02),
        (Measure::ImageSimilarity, 0.01),
        (Measure::Rmse, 0.01),
        (Measure::MutualInformation, 0.05),
        (Measure::CentroidError, 0.05),
    ] {
        let of = |comparison: &Comparison| comparison.score(measure).value.unwrap();
        let apart = (of(&whole) - of(&thinned)).abs();
        assert!(apart < slack, "{measure}: {apart}");
        let ceiling = |comparison: &Comparison| comparison.score(measure).ceiling.unwrap();
        let apart = (ceiling(&whole) - ceiling(&thinned)).abs();
        assert!(apart < slack, "ceiling of {measure}: {apart}");
    }
    let sigmas = [&whole, &thinned].map(|comparison| comparison.noise_sigma_c.unwrap());
    assert!((sigmas[0] / sigmas[1] - 1.0).abs() < 0.02, "{sigmas:?}");
    // By chance, as with any sensor of so little noise; the borders add nothing.
    let shares = [(&whole, all.len()), (&thinned, kept.records.len())].map(|(comparison, rows)| {
        let left_out = &comparison.alignment.as_ref().unwrap().left_out;
        assert!(
            left_out.iter().all(|left| left.reason == LeftOut::Torn),
            "{left_out:?}"
        );
        let torn: usize = left_out.iter().map(|left| left.rows).sum();
        1_000 * torn / rows
    });
    assert!(
        shares[0] <= 6 && shares[0].abs_diff(shares[1]) <= 2,
        "{shares:?}"
    );
}
