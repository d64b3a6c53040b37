//! Verdicts on recordings of the paper's scenes, and on real frames, compared with right and wrong scenes.

use grideye_frame::{Celsius, NoData, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::{Scene, Simulator};
use grideye_validator::{
    Measure, Options, Protocol, ValidatorError, Verdict, compare_scene, sensor_step_c,
};
use std::io;
use std::time::Duration;

pub(crate) const SENSOR: &str = "ceiling";

/// The text of one of the paper's experiments from the repository's scenes.
pub(crate) fn experiment(number: u32) -> String {
    std::fs::read_to_string(format!(
        "{}/../../scenes/experiment-{number}.toml",
        env!("CARGO_MANIFEST_DIR")
    ))
    .unwrap()
}

pub(crate) fn parse(text: &str) -> Scene {
    let files = |relative: &str| -> io::Result<String> {
        std::fs::read_to_string(format!(
            "{}/../../scenes/{relative}",
            env!("CARGO_MANIFEST_DIR")
        ))
    };
    Scene::parse(text, "scene.toml", &files).unwrap().scene
}

/// A recording of the scene by its sensor: noise of another seed, the sensor's steps.
pub(crate) fn record(scene: &Scene, frames: u32, seed: u64) -> Vec<Record> {
    let simulator = Simulator::new(scene, SENSOR).unwrap();
    (0..frames)
        .map(|index| {
            let time = Duration::from_millis(100) * index;
            let image = simulator
                .noisy(time, seed)
                .to_frame(Celsius::new(25.0))
                .unwrap();
            let pixels = image
                .pixels
                .map(|pixel| grideye_frame::word::pixel_word(pixel).unwrap());
            row(
                index,
                time,
                Reading::Frame(RecordedFrame {
                    thermistor: Some(ThermistorWord(400)),
                    pixels,
                }),
            )
        })
        .collect()
}

fn row(index: u32, time: Duration, reading: Reading<RecordedFrame>) -> Record {
    let t_boot_ns = 5_000_000_000 + u64::try_from(time.as_nanos()).unwrap();
    let stamp = Stamp {
        t_boot_ns,
        t_utc_ns: 0,
        clock: ClockState::Unsynced,
    };
    Record {
        seq: u64::from(index),
        stamp,
        reading,
    }
}

fn options(seed: u64) -> Options {
    Options {
        seed,
        shuffles: 20,
        ..Options::default()
    }
}

fn whole_walk(scene: &Scene) -> u32 {
    u32::try_from(scene.frame_count(scene.sensor(SENSOR).unwrap())).unwrap()
}

fn all_seeds() -> bool {
    std::env::var_os("GRIDEYE_ALL_SEEDS").is_some_and(|value| value == "1")
}

/// The verdict over seeds of recording and comparison.
#[track_caller]
fn verdict_over_seeds(expected: Verdict, seen: &Scene, frames: u32, claimed: &Scene) {
    for seed in 0..if all_seeds() { 50 } else { 2 } {
        let records = record(seen, frames, seed);
        let judgment = compare_scene(&records, claimed, SENSOR, &options(seed))
            .unwrap()
            .judgment;
        assert_eq!(
            judgment.verdict, expected,
            "seed {seed}: {:#?}",
            judgment.reasons
        );
    }
}

#[track_caller]
fn never_agrees(scene: &Scene, frames: u32, claimed: &Scene) {
    for seed in 0..if all_seeds() { 5 } else { 1 } {
        let records = record(scene, frames, seed);
        let judgment = compare_scene(&records, claimed, SENSOR, &options(seed))
            .unwrap()
            .judgment;
        assert_ne!(
            judgment.verdict,
            Verdict::Agrees,
            "seed {seed}: {:#?}",
            judgment.reasons
        );
    }
}

#[track_caller]
fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(
        text.contains(from),
        "the scene has changed: no `{from}` in it"
    );
    text.replace(from, to)
}

fn without_agent(text: &str) -> String {
    let (before, after) = text.split_once("[[agent]]").unwrap();
    format!(
        "{before}[[sensor]]{}",
        after.split_once("[[sensor]]").unwrap().1
    )
}

#[test]
fn the_papers_standing_scenes_agree_with_themselves() {
    let scene = parse(&experiment(1));
    verdict_over_seeds(Verdict::Agrees, &scene, 20, &scene);
    // The person makes 2 x 2 pixels in a corner 0.45 °C warmer, which an unknown unit and room may do too.
    let scene = parse(&experiment(2));
    verdict_over_seeds(Verdict::CannotTell, &scene, 20, &scene);
}

#[test]
fn the_papers_walks_agree_with_themselves() {
    for number in [3, 4] {
        let scene = parse(&experiment(number));
        verdict_over_seeds(Verdict::Agrees, &scene, whole_walk(&scene), &scene);
    }
}

#[test]
fn a_person_standing_elsewhere_does_not_agree() {
    let text = experiment(1);
    let scene = parse(&text);
    let at = "position_mm = [1200, 1350, 0]";
    for elsewhere in [
        "[2200, 1350, 0]",
        "[1200, 2350, 0]",
        "[1700, 1350, 0]",
        "[1200, 850, 0]",
    ] {
        let claimed = parse(&replaced(&text, at, &format!("position_mm = {elsewhere}")));
        never_agrees(&scene, 20, &claimed);
    }
    let text = experiment(2);
    let moved = parse(&replaced(
        &text,
        "position_mm = [2300, 450, 0]",
        "position_mm = [1300, 450, 0]",
    ));
    never_agrees(&parse(&text), 20, &moved);
}

#[test]
fn a_missing_person_does_not_agree() {
    for number in [1, 3, 4] {
        let text = experiment(number);
        let scene = parse(&text);
        let frames = if scene.is_static() {
            20
        } else {
            whole_walk(&scene)
        };
        never_agrees(&scene, frames, &parse(&without_agent(&text)));
    }
}

#[test]
fn a_person_of_34_degrees_for_one_of_28_disagrees_if_clothes_are_known() {
    let text = experiment(1);
    let (before, person) = text.split_once("[[agent]]").unwrap();
    let hot = format!(
        "{before}[[agent]]{}",
        person.replacen("temperature_c = 28", "temperature_c = 34", 1)
    );
    assert_ne!(hot, text);
    let known = "\n[[uncertain]]\nkey = \"agent.*.contrast\"\nsd = 0.1\n";
    let claimed = parse(&format!("{hot}{known}"));
    verdict_over_seeds(Verdict::Disagrees, &parse(&text), 20, &claimed);
}

/// A mirrored sensor: each row of the recording runs backwards.
#[test]
fn a_mirrored_recording_does_not_agree() {
    for number in [2, 3] {
        let scene = parse(&experiment(number));
        let frames = if scene.is_static() {
            20
        } else {
            whole_walk(&scene)
        };
        for seed in 0..5 {
            let mirrored: Vec<Record> = record(&scene, frames, seed)
                .into_iter()
                .map(mirror)
                .collect();
            let judgment = compare_scene(&mirrored, &scene, SENSOR, &options(seed))
                .unwrap()
                .judgment;
            assert_ne!(
                judgment.verdict,
                Verdict::Agrees,
                "{number} {seed}: {:#?}",
                judgment.reasons
            );
        }
    }
}

fn mirror(record: Record) -> Record {
    let reading = record.reading.map(|mut raw| {
        raw.pixels.chunks_mut(8).for_each(<[PixelWord]>::reverse);
        raw
    });
    Record { reading, ..record }
}

/// A second of delay at 0.5 m/s is half a meter.
#[test]
fn a_walk_that_starts_a_second_late_disagrees() {
    for number in [3, 4] {
        let scene = parse(&experiment(number));
        for seed in 0..5 {
            let records = record(&scene, whole_walk(&scene), seed);
            let late = Options {
                start_s: Some(1.0),
                ..options(seed)
            };
            let comparison = compare_scene(&records, &scene, SENSOR, &late).unwrap();
            assert_eq!(comparison.judgment.verdict, Verdict::Disagrees);
            assert!(
                comparison
                    .notes
                    .iter()
                    .any(|note| note.contains("before the scene's start or after its end"))
            );
        }
    }
}

#[test]
fn an_empty_room_refutes_a_person_and_tells_nothing_of_an_empty_scene() {
    let text = experiment(1);
    let (room, sensors) = text.split_once("[[object]]").unwrap();
    let empty = parse(&format!(
        "{room}[[sensor]]{}",
        sensors.split_once("[[sensor]]").unwrap().1
    ));
    verdict_over_seeds(Verdict::CannotTell, &empty, 20, &empty);
    verdict_over_seeds(Verdict::Disagrees, &empty, 20, &parse(&text));
}

#[test]
fn three_degrees_of_offset_are_noticed() {
    let text = experiment(1);
    let scene = parse(&text);
    let warmer = parse(
        &replaced(&text, "ambient_c = 23.5", "ambient_c = 26.5")
            .replace("temperature_c = 28", "temperature_c = 31"),
    );
    for (seen, claimed, direction) in [(&warmer, &scene, "warmer"), (&scene, &warmer, "colder")] {
        let records = record(seen, 20, 1);
        let comparison = compare_scene(&records, claimed, SENSOR, &options(1)).unwrap();
        assert_eq!(comparison.judgment.verdict, Verdict::Disagrees);
        assert!(
            (comparison.offset_c.abs() - 3.0).abs() < 0.1,
            "{}",
            comparison.offset_c
        );
        assert!(
            comparison.judgment.reasons[0].contains(direction),
            "{:?}",
            comparison.judgment.reasons
        );
        assert!(
            comparison.score(Measure::Correlation).skill().unwrap() > 0.6,
            "C is blind to it"
        );
    }
}

/// The recording was simulated with the comparison's seed; the noise must still differ.
#[test]
fn the_same_seed_still_gives_other_noise() {
    let scene = parse(&experiment(3));
    let comparison = compare_scene(
        &record(&scene, whole_walk(&scene), 7),
        &scene,
        SENSOR,
        &options(7),
    )
    .unwrap();
    // Noise of 0.2 degrees on either side; equal noise would leave only the sensor's rounding, 0.07 degrees.
    let rmse = comparison.score(Measure::Rmse).value.unwrap();
    assert!((rmse - 0.2 * 2.0_f64.sqrt()).abs() < 0.03, "{rmse}");
}

#[test]
fn frames_are_chosen_evenly_and_gaps_left_out_with_a_note() {
    let scene = parse(&experiment(1));
    let mut records = record(&scene, 101, 1);
    for index in [3, 50, 51] {
        records[index].reading = Reading::NoData(NoData::Nack);
    }
    let comparison = compare_scene(&records, &scene, SENSOR, &options(1)).unwrap();
    assert_eq!(
        (
            comparison.real_frames,
            comparison.simulated_frames,
            comparison.pairs
        ),
        (10, 10, 100)
    );
    assert_eq!(comparison.settings.protocol, Protocol::Static);
    assert_eq!(comparison.settings.lag_frames, 3);
    // Frame 0 has lost its repeat; frame 97 is the last one that has one.
    assert_eq!(
        comparison.timeline.first().unwrap().time,
        Duration::from_millis(100)
    );
    assert_eq!(
        comparison.timeline.last().unwrap().time,
        Duration::from_millis(9_700)
    );
    assert!(
        comparison
            .notes
            .iter()
            .any(|note| note.starts_with("Left out 3 of 101 rows (not read: "))
    );
    let five = Options {
        frames: Some(5),
        ..options(1)
    };
    assert_eq!(
        compare_scene(&records, &scene, SENSOR, &five)
            .unwrap()
            .pairs,
        25
    );
}

#[test]
fn a_walk_is_compared_frame_by_frame_with_the_next_frame_as_repeat() {
    let scene = parse(&experiment(3));
    let comparison = compare_scene(
        &record(&scene, whole_walk(&scene), 1),
        &scene,
        SENSOR,
        &options(1),
    )
    .unwrap();
    assert_eq!(comparison.settings.protocol, Protocol::Dynamic);
    assert_eq!(comparison.settings.lag_frames, 1);
    assert_eq!(comparison.pairs, comparison.real_frames);
}

#[test]
fn invalid_input_is_rejected_with_the_reason() {
    let text = experiment(3);
    let scene = parse(&text);
    let records = record(&scene, 10, 1);
    let refused = |records: &[Record], scene: &Scene, sensor: &str, options: &Options| {
        compare_scene(records, scene, sensor, options).unwrap_err()
    };
    assert!(matches!(
        refused(&records, &scene, "attic", &options(1)),
        ValidatorError::Scene(_)
    ));
    let error = refused(&[], &scene, SENSOR, &options(1)).to_string();
    assert!(error.starts_with("no real frame to compare\n"), "{error}");

    let mut backwards = records.clone();
    backwards[6].stamp.t_boot_ns -= 804_000_000;
    let error = refused(&backwards, &scene, SENSOR, &options(1));
    assert!(
        error
            .to_string()
            .starts_with("time goes back by 704ms at frame 6 of the recording\nhint: "),
        "{error}"
    );

    let after = Options {
        start_s: Some(3_600.0),
        ..options(1)
    };
    let error = refused(&records, &scene, SENSOR, &after).to_string();
    assert!(
        error.contains(" into the scene, which ends after "),
        "{error}"
    );
    for options in [
        Options {
            frames: Some(0),
            ..options(1)
        },
        Options {
            lag_frames: Some(0),
            ..options(1)
        },
        Options {
            lag_frames: Some(grideye_validator::LAG_FRAMES_MAX + 1),
            ..options(1)
        },
    ] {
        let error = refused(&records, &scene, SENSOR, &options).to_string();
        assert!(error.starts_with("setting `"), "{error}");
    }
    let lepton = parse(&replaced(
        &text,
        "preset = \"grid-eye\"",
        "resolution = [80, 60]\nfov_deg = [50, 50]\nnoise_sigma_c = 1.6",
    ));
    let error = refused(&records, &lepton, SENSOR, &options(1));
    assert!(
        error
            .to_string()
            .contains("has 80 x 60 pixels, the recording has 8 x 8"),
        "{error}"
    );
}

#[test]
fn the_step_is_the_drivers() {
    // AMG88 spec §4-11-11: one LSB of a pixel is a quarter of a degree.
    assert_eq!(sensor_step_c(), 1.0 / 4.0);
}

/// Rows of session 2 of LINAIGE, a real ceiling-mounted sensor at 10 Hz (`recordings/linaige/SOURCE.md`).
fn linaige(rows: std::ops::Range<usize>) -> Vec<Record> {
    let name = "Session2_2021-07-01_RoomB_v2.csv";
    let path = format!(
        "{}/../../recordings/linaige/{name}",
        env!("CARGO_MANIFEST_DIR")
    );
    let file = std::fs::File::open(path).unwrap();
    grideye_import::open(file, name, &Default::default())
        .unwrap()
        .map(|row| row.unwrap().record)
        .skip(rows.start)
        .take(rows.len())
        .collect()
}

/// Rows 1376 to 1475 show an empty room: a real unit's fixed pattern and noise must not count as warm.
#[test]
fn a_real_empty_room_cannot_tell() {
    let scene = parse(&replaced(
        &experiment(1),
        "ambient_c = 23.5",
        "ambient_c = 26",
    ));
    let comparison = compare_scene(&linaige(1376..1476), &scene, SENSOR, &options(1)).unwrap();
    assert_eq!(
        comparison.judgment.verdict,
        Verdict::CannotTell,
        "{:?}",
        comparison.judgment.reasons
    );
    assert!(comparison.judgment.reasons[0].contains("only the room and noise"));
    let sigma = comparison.noise_sigma_c.unwrap();
    assert!((0.25..0.42).contains(&sigma), "{sigma}");
}

/// Rows 740 to 895 show one person away from the point below the sensor: a made-up scene must not agree.
#[test]
fn a_real_person_is_seen_and_a_made_up_scene_disagrees() {
    let scene = parse(&replaced(
        &experiment(1),
        "ambient_c = 23.5",
        "ambient_c = 26",
    ));
    let comparison = compare_scene(&linaige(740..896), &scene, SENSOR, &options(1)).unwrap();
    assert_eq!(
        comparison.judgment.verdict,
        Verdict::Disagrees,
        "{:?}",
        comparison.judgment.reasons
    );
    assert!(comparison.score(Measure::Correlation).ceiling.unwrap() > 0.7);
}
