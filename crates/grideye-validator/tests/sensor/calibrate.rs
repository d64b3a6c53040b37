//! Calibration against emulated recordings with known truth.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_frame::{Celsius, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::profile::Profile;
use grideye_scene::{Scene, Simulator};
use grideye_validator::ValidatorError;
use grideye_validator::calibrate::{Calibration, FRAMES_MAX, Options, Progress, calibrate};
use std::collections::BTreeMap;
use std::time::Duration;

/// A person walks in a bend below a tilted sensor, beside a radiator.
const SCENE: &str = r#"[room]
size_mm = [4000, 5000, 2700]
ambient_c = 20

[[object]]
name = "radiator"
position_mm = [3000, 1200, 100]
size_mm = [500, 500, 500]
temperature_c = 40 # on

[[agent]]
name = "person"
size_mm = [200, 450, 1700]
temperature_c = 29
emissivity = 0.8
trajectory = "walk.csv"
speed_mm_per_s = 400

[[sensor]]
name = "ceiling"
preset = "grid-eye"
position_mm = [2000, 2000, 2600]
elevation_deg = 75
azimuth_deg = 90
roll_deg = 3
fov_deg = 60
noise_sigma_c = 0.2
"#;

const WALK: &str = "x_mm,y_mm,z_mm\n1000,1500,0\n2800,2600,0\n1200,3400,0\n";

/// A typical unit: noise, a pattern that differs between seeds, a common mode with its cycle.
pub(crate) const UNIT: &str = "[noise]\nsigma_c = 0.25\n[common_mode]\nsd_c = 0.08\ncorrelation_s = 1.5\ncycle_depth_c = 0.08\n\
    [fixed_pattern]\nspread_c = 0.2\n";

pub(crate) type Unknown = (&'static str, f64, f64, f64);

/// Key, lower bound, upper bound, truth.
pub(crate) const EIGHT: [Unknown; 8] = [
    ("room.ambient_c", 15.0, 25.0, 20.0),
    ("agent.person.temperature_c", 22.0, 36.0, 29.0),
    ("object.radiator.temperature_c", 25.0, 60.0, 40.0),
    ("sensor.ceiling.position_mm.x", 1500.0, 2500.0, 2000.0),
    ("sensor.ceiling.elevation_deg", 60.0, 90.0, 75.0),
    ("sensor.ceiling.azimuth_deg", 70.0, 110.0, 90.0),
    ("sensor.ceiling.roll_deg", -10.0, 15.0, 3.0),
    ("recording.start_s", -1.0, 1.0, 0.3),
];

pub(crate) fn files() -> BTreeMap<String, String> {
    BTreeMap::from([("walk.csv".to_owned(), WALK.to_owned())])
}

/// The scene with these unknowns, each a third of the way between its bounds.
pub(crate) fn unknown(fits: &[Unknown]) -> String {
    let mut text = SCENE.to_owned();
    for (key, low, high, _) in fits {
        text.push_str(&format!(
            "\n[[uncertain]]\nkey = \"{key}\"\nbounds = [{low}, {high}]\n"
        ));
    }
    let loaded = Scene::parse(&text, "truth.toml", &files()).unwrap();
    let guesses: Vec<f64> = fits
        .iter()
        .map(|(_, low, high, _)| low + (high - low) / 3.0)
        .collect();
    grideye_scene::uncertain::with_values(&text, loaded.scene.uncertain(), &guesses)
}

/// What a unit sees of the true scene, rounded like the chip; the recording starts at `start_s` of the scene.
pub(crate) fn record(
    unit: &str,
    seed: u64,
    frames: u32,
    interval_ms: u32,
    start_s: f64,
) -> Vec<Record> {
    let scene = Scene::parse(SCENE, "truth.toml", &files()).unwrap().scene;
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    let profile = Profile::parse(unit, "unit.toml").unwrap();
    (0..frames)
        .map(|index| {
            let since = Duration::from_millis(u64::from(index * interval_ms));
            let image = simulator.image(since + Duration::from_secs_f64(start_s));
            let perfect = image.to_frame(Celsius::new(20.0)).unwrap();
            let tick = u64::from(index * interval_ms / 100);
            let measured = profile.apply(seed, tick, since + Duration::from_secs(30), perfect);
            Record {
                seq: u64::from(index),
                stamp: Stamp {
                    t_boot_ns: 7_000_000_000 + u64::try_from(since.as_nanos()).unwrap(),
                    t_utc_ns: 0,
                    clock: ClockState::Unsynced,
                },
                reading: Reading::Frame(RecordedFrame {
                    thermistor: Some(ThermistorWord(400)),
                    pixels: measured
                        .pixels
                        .map(|pixel| PixelWord(quarters(pixel.get()))),
                }),
            }
        })
        .collect()
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "temperatures of a room in quarters of a degree"
)]
pub(crate) fn quarters(celsius: f32) -> u16 {
    (celsius * 4.0).round() as u16
}

/// Whether to run all 50 seeds.
pub(crate) fn seeds() -> bool {
    std::env::var_os("GRIDEYE_ALL_SEEDS").is_some_and(|value| value == "1")
}

pub(crate) fn run(
    text: &str,
    records: &[Record],
    options: &Options,
) -> Result<Calibration, ValidatorError> {
    let scene = (text, "guess.toml");
    calibrate(records, scene, &files(), "ceiling", options, &mut |_| ())
}

#[test]
fn without_noise_the_truth_is_found_to_the_sensors_steps() {
    let records = record("", 1, 100, 100, 0.3);
    let found = run(&unknown(&EIGHT), &records, &Options::default()).unwrap();
    for (found, (key, low, high, truth)) in found.found.iter().zip(EIGHT) {
        assert_eq!(found.key, key);
        assert!(
            (found.value - truth).abs() < 0.01 * (high - low),
            "{found:?}"
        );
    }
    assert!(
        found.rmse_c[1] < 0.08 && found.rmse_c[0] > 0.3,
        "{:?}",
        found.rmse_c
    );
}

/// The 95 % interval must hold the truth about 95 times in 100: 8 unknowns of 50 units make 400, of which chance leaves
/// out 20 ± 4.4 (twice that, since those of one unit are not independent).
#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    let text = unknown(&EIGHT);
    let (seeds, shares, least) = if seeds() {
        (50_u32, 0.92..=0.985, 42)
    } else {
        (12, 0.86..=1.0, 9)
    };
    let mut held = [0_u32; 8];
    let mut sums = [[0.0; 3]; 8];
    let mut slowest = Duration::ZERO;
    for seed in 0..seeds {
        let records = record(UNIT, u64::from(seed), 100, 100, 0.3);
        let begin = std::time::Instant::now();
        let found = run(&text, &records, &Options::default()).unwrap();
        slowest = slowest.max(begin.elapsed());
        for (place, (found, unknown)) in found.found.iter().zip(EIGHT).enumerate() {
            let half = found.half_width_95.unwrap_or(0.0);
            let error = found.value - unknown.3;
            held[place] += u32::from(error.abs() <= half);
            sums[place][0] += error;
            sums[place][1] += error * error;
            sums[place][2] += found.uncertainty.unwrap_or(0.0);
        }
    }
    println!(
        "unknown                          truth  mean error  rms error  stated  held of {seeds}"
    );
    let of = 1.0 / f64::from(seeds);
    for (place, (key, _, _, truth)) in EIGHT.iter().enumerate() {
        let [error, square, stated] = sums[place];
        println!(
            "{key:<30} {truth:>7} {:>11.3} {:>10.3} {:>7.3} {:>8}",
            error * of,
            (square * of).sqrt(),
            stated * of,
            held[place]
        );
    }
    let share = f64::from(held.iter().sum::<u32>()) / f64::from(8 * seeds);
    println!(
        "together {:.1} %; 8 unknowns, 100 frames, at most {slowest:?}",
        100.0 * share
    );
    assert!(shares.contains(&share), "{share}");
    assert!(held.iter().all(|held| *held >= least), "{held:?}");
}

#[test]
fn emissivity_and_temperature_are_reported_as_correlated() {
    let fits = [
        ("agent.person.temperature_c", 22.0, 40.0, 29.0),
        ("agent.person.emissivity", 0.5, 1.0, 0.8),
    ];
    let found = run(
        &unknown(&fits),
        &record(UNIT, 1, 100, 100, 0.0),
        &Options::default(),
    )
    .unwrap();
    assert!(
        found.correlation[0][1].abs() > 0.95,
        "{:?}",
        found.correlation
    );
    let warned = found.warnings.join("\n");
    assert!(
        warned.contains(
            "`agent.person.temperature_c` and `agent.person.emissivity` can hardly be told apart"
        ),
        "{warned}"
    );
}

#[test]
fn unknowns_with_the_same_effect_have_no_uncertainty() {
    // Straight down, azimuth and roll are the same rotation.
    let straight = |text: String| text.replace("elevation_deg = 75", "elevation_deg = 90");
    let fits = [
        ("sensor.ceiling.azimuth_deg", 70.0, 110.0, 90.0),
        ("sensor.ceiling.roll_deg", -10.0, 15.0, 3.0),
        ("room.ambient_c", 15.0, 25.0, 20.0),
    ];
    let found = run(
        &straight(unknown(&fits)),
        &record(UNIT, 1, 60, 100, 0.0),
        &Options::default(),
    )
    .unwrap();
    let warned = found.warnings.join("\n");
    assert!(
        warned.contains(
            "`sensor.ceiling.azimuth_deg` and `sensor.ceiling.roll_deg` cannot be told apart"
        ),
        "{warned}"
    );
    assert_eq!(
        (found.found[0].uncertainty, found.found[1].uncertainty),
        (None, None)
    );
    assert!(found.found[2].uncertainty.is_some());
}

#[test]
fn an_unknown_outside_its_bounds_is_reported_at_its_bound() {
    let text = SCENE.replace("temperature_c = 29", "temperature_c = 24")
        + "
[[uncertain]]
key = \"agent.person.temperature_c\"
bounds = [22, 26]
";
    let found = run(&text, &record(UNIT, 1, 60, 100, 0.0), &Options::default()).unwrap();
    assert!(found.found[0].at_bound && found.found[0].uncertainty.is_none());
    assert_eq!(found.found[0].value, 26.0);
    assert!(
        found
            .warnings
            .iter()
            .any(|warning| warning.contains("lies at a bound, 26"))
    );
}

#[test]
fn noise_and_pattern_are_what_the_unit_has() {
    let fits = [
        ("sensor.ceiling.noise_sigma_c", 0.01, 1.0, 0.25),
        ("room.ambient_c", 15.0, 25.0, 20.0),
    ];
    let pattern: Vec<String> = (0..64)
        .map(|pixel| format!("{}", f64::from(pixel * 37 % 11) * 0.06 - 0.3))
        .collect();
    let unit = format!(
        "[noise]\nsigma_c = 0.25\n[fixed_pattern]\noffset_c = [{}]\n",
        pattern.join(", ")
    );
    let found = run(
        &unknown(&fits),
        &record(&unit, 3, 100, 100, 0.0),
        &Options::default(),
    )
    .unwrap();
    assert!(
        (found.found[0].value - 0.25).abs() < 0.006,
        "{:?}",
        found.found[0]
    );
    let mean = found.pattern_c.iter().sum::<f64>() / 64.0;
    for (pixel, offset) in found.pattern_c.iter().enumerate() {
        let truth: f64 = pattern[pixel].parse().unwrap();
        assert!(
            (offset - mean - truth).abs() < 0.13,
            "{pixel}: {offset} {truth}"
        );
    }
    assert!(
        (found.pattern_sd_c - 0.19).abs() < 0.02,
        "{}",
        found.pattern_sd_c
    );
}

/// Passed as a profile, the pattern is subtracted, and what it hid is found better.
#[test]
fn a_known_pattern_is_subtracted() {
    let pattern: Vec<String> = (0..64)
        .map(|pixel| format!("{}", f64::from(pixel % 8) * 0.1))
        .collect();
    let unit = format!(
        "[noise]\nsigma_c = 0.2\n[fixed_pattern]\noffset_c = [{}]\n",
        pattern.join(", ")
    );
    let fits = [("room.ambient_c", 15.0, 25.0, 20.0)];
    let records = record(&unit, 3, 60, 100, 0.0);
    let blind = run(&unknown(&fits), &records, &Options::default()).unwrap();
    let knowing = Options {
        profile: Some(Profile::parse(&unit, "unit.toml").unwrap()),
        ..Options::default()
    };
    let told = run(&unknown(&fits), &records, &knowing).unwrap();
    assert!(
        (blind.found[0].value - 20.0).abs() > 0.1,
        "{:?}",
        blind.found[0]
    );
    assert!(
        (told.found[0].value - 20.0).abs() < 0.03,
        "{:?}",
        told.found[0]
    );
    assert!(told.pattern_sd_c < 0.02, "{}", told.pattern_sd_c);
}

#[test]
fn the_new_scene_keeps_every_other_byte_and_can_be_calibrated_again() {
    let fits = [EIGHT[2]];
    let text = unknown(&fits);
    let records = record(UNIT, 1, 60, 100, 0.0);
    let once = run(&text, &records, &Options::default()).unwrap();
    let value = once.found[0].value;
    assert!(
        once.scene
            .contains(&format!("temperature_c = {value} # on\n")),
        "{}",
        once.scene
    );
    let remark = format!(
        "[[uncertain]]\n# found: {}\nkey = \"object.radiator.temperature_c\"\n",
        once.found[0].told()
    );
    assert!(once.scene.contains(&remark), "{}", once.scene);
    let (front, table) = once.scene.split_once("\n[[calibrated]]\n").unwrap();
    assert!(table.contains("\nkeys = [\"object.radiator.temperature_c\"]\n"));
    let back = front
        .replace(&format!("# found: {}\n", once.found[0].told()), "")
        .replace(&format!("= {value} # on"), "= 36.666666666666664 # on");
    assert_eq!(back, text);
    let twice = run(&once.scene, &records, &Options::default()).unwrap();
    for once in ["# found: ", "[[calibrated]]", "\nframes = "] {
        assert_eq!(twice.scene.matches(once).count(), 1, "{}", twice.scene);
    }
    assert_eq!(
        twice.scene.split_once("\n[[calibrated]]\n").unwrap().1,
        table
    );
}

/// What a table without a number in the file says is for a comparison.
const KNOWN: &str = "\n[[uncertain]]\nkey = \"agent.*.aside_m\"\nsd = 0.1\n\
    \n[[uncertain]]\nkey = \"recording.start_s\"\nsd = 0.5\n";

#[test]
fn what_is_no_number_of_the_file_is_ignored_and_kept() {
    let records = record(UNIT, 1, 60, 100, 0.0);
    let (front, back) = (unknown(&[EIGHT[0]]), unknown(&[EIGHT[0]]) + KNOWN);
    let plain = run(&front, &records, &Options::default()).unwrap();
    let known = run(&back, &records, &Options::default()).unwrap();
    assert_eq!(known.found, plain.found);
    assert!(known.scene.contains(KNOWN), "{}", known.scene);
}

/// Of a value from the recording and one known before, both as certain, the middle is found, and 1/√2 of the uncertainty.
#[test]
fn what_is_known_before_counts_by_its_uncertainty() {
    let records = record(UNIT, 1, 60, 100, 0.0);
    let text = unknown(&[EIGHT[0]]);
    let alone = run(&text, &records, &Options::default()).unwrap();
    let (value, own) = (alone.found[0].value, alone.found[0].uncertainty.unwrap());
    assert_eq!(alone.found[0].from_recording, Some(1.0));
    let law = format!("{text}sd = {own}\nmean = {}\n", value + own);
    let both = run(&law, &records, &Options::default()).unwrap();
    let found = &both.found[0];
    assert!(
        (found.value - value - 0.5 * own).abs() < 0.1 * own,
        "{found:?}"
    );
    let share = found.uncertainty.unwrap() / own;
    assert!((share - 0.5_f64.sqrt()).abs() < 0.05, "{found:?}");
    assert!(
        (found.from_recording.unwrap() - 0.5).abs() < 0.05,
        "{found:?}"
    );
    assert!(
        found
            .told()
            .contains(" % from the recording, the rest from"),
        "{}",
        found.told()
    );
    assert!(
        (both.determined.combinations - 0.5).abs() < 0.05,
        "{:?}",
        both.determined
    );
}

/// Otherwise a second calibration would take the value found for what was known before, and count the recording twice.
#[test]
fn the_new_scene_keeps_what_was_known_before() {
    let text = unknown(&[EIGHT[0]]) + "sd = 0.1\n";
    let records = record(UNIT, 1, 60, 100, 0.0);
    let once = run(&text, &records, &Options::default()).unwrap();
    let start = once.found[0].start;
    assert!(
        once.scene.contains(&format!(
            "\nmean = {start}\n# found: {}\nkey = ",
            once.found[0].told()
        )),
        "{}",
        once.scene
    );
    let twice = run(&once.scene, &records, &Options::default()).unwrap();
    let moved = (twice.found[0].value - once.found[0].value).abs();
    assert!(moved < 0.2 * once.found[0].uncertainty.unwrap(), "{moved}");
    for once in ["mean = ", "# found: ", "\nsd = { "] {
        assert_eq!(twice.scene.matches(once).count(), 1, "{}", twice.scene);
    }
}

/// Azimuth and roll of a sensor that looks straight down only show as a sum: one of two combinations.
#[test]
fn the_least_determined_combination_is_named() {
    let text = unknown(&[EIGHT[5], EIGHT[6]]).replace("elevation_deg = 75", "elevation_deg = 90");
    let found = run(&text, &record(UNIT, 1, 60, 100, 0.0), &Options::default()).unwrap();
    let determined = &found.determined;
    assert!(
        (determined.combinations - 1.0).abs() < 0.05,
        "{determined:?}"
    );
    assert!(determined.least_from_recording < 0.05, "{determined:?}");
    // In units of what is known: 40° and 25° between the bounds; the same turn in degrees, of both signs or of one.
    let degrees: Vec<f64> = determined
        .least
        .iter()
        .map(|(_, share, unit)| share * unit)
        .collect();
    assert!(
        (degrees[0].abs() / degrees[1].abs() - 1.0).abs() < 0.05,
        "{determined:?}"
    );
    assert!(
        found
            .text()
            .contains("the recording determines 1.0 of 2 combinations"),
        "{}",
        found.text()
    );
}

/// From the wrong side of the room a single search ends elsewhere; one of several starts reaches the right end.
#[test]
fn several_starts_find_what_one_does_not() {
    let fits = [
        ("sensor.ceiling.azimuth_deg", -180.0, 180.0, 90.0),
        ("sensor.ceiling.position_mm.x", 200.0, 3800.0, 2000.0),
        ("sensor.ceiling.elevation_deg", 30.0, 90.0, 75.0),
    ];
    let records = record(UNIT, 1, 60, 100, 0.0);
    let found = |starts: usize| {
        let options = Options {
            starts,
            ..Options::default()
        };
        run(&unknown(&fits), &records, &options).unwrap().found[0].value
    };
    assert!((found(8) - 90.0).abs() < 3.0, "{}", found(8));
    assert!((found(1) - 90.0).abs() > 20.0, "{}", found(1));
}

/// If the recording may begin a second later, its last second may lie beyond the walk.
#[test]
fn frames_that_may_lie_beyond_the_end_are_left_out() {
    let scene = Scene::parse(SCENE, "truth.toml", &files()).unwrap().scene;
    let until = scene.duration() - Duration::from_secs(1);
    let records = record(UNIT, 1, 140, 100, 0.0);
    let options = Options {
        frames: Some(FRAMES_MAX),
        starts: 1,
        ..Options::default()
    };
    let found = run(&unknown(&[EIGHT[7]]), &records, &options).unwrap();
    let within = (0..140).filter(|index| Duration::from_millis(100 * index) <= until);
    let within = within.count();
    assert!(within < 130, "{:?}", scene.duration());
    // Torn by chance.
    assert!(
        (within - found.frames_left_out..=within).contains(&found.frames),
        "{found:?}"
    );
}

/// Two starts of at most 12 steps on 24 frames each, three more searches of as many, then four of at most 40 steps on 60
/// frames.
#[test]
fn progress_reaches_the_total() {
    let mut told: Vec<Progress> = Vec::new();
    let options = Options {
        starts: 2,
        ..Options::default()
    };
    calibrate(
        &record(UNIT, 1, 60, 100, 0.0),
        (&unknown(&[EIGHT[0], EIGHT[1]]), "guess.toml"),
        &files(),
        "ceiling",
        &options,
        &mut |progress| told.push(progress),
    )
    .unwrap();
    let total = 5 * 12 * 24 + 4 * 40 * 60;
    assert!(told.iter().all(|progress| progress.total == total));
    assert!(told.is_sorted_by_key(|progress| progress.done));
    assert_eq!(told[0].done, 24);
    assert_eq!(
        told.iter()
            .filter(|progress| progress.done == 5 * 12 * 24)
            .count(),
        1
    );
    assert_eq!(told.last().unwrap().done, total);
}

#[test]
fn invalid_calibrations_are_rejected() {
    let records = record(UNIT, 1, 60, 100, 0.0);
    let said = |text: &str, records: &[Record], options: &Options| {
        run(text, records, options).unwrap_err().to_string()
    };
    let options = Options::default();
    let good = unknown(&[EIGHT[0]]);
    let only_known = format!("{SCENE}{KNOWN}");
    for none in [SCENE, &only_known] {
        assert!(said(none, &records, &options).contains("marks no number to find\nhint: "));
    }
    assert!(said(&good, &records[..9], &options).contains("9 frames of the recording"));
    let mut back = records.clone();
    back[30].stamp.t_boot_ns -= 1_000_000_000;
    assert!(said(&good, &back, &options).contains("runs backwards at frame 30"));
    let wide = unknown(&[("sensor.ceiling.elevation_deg", 60.0, 99.0, 75.0)]);
    let refused = said(&wide, &records, &options);
    assert!(
        refused.contains("the upper bound 99 of `sensor.ceiling.elevation_deg`")
            && refused.contains("hint: "),
        "{refused}"
    );
    let many = Options {
        frames: Some(FRAMES_MAX + 1),
        ..Options::default()
    };
    assert!(said(&good, &records, &many).contains("1001 frames requested, expected 10 to 1000"));
    let lepton = good.replace("preset = \"grid-eye\"", "preset = \"lepton\"");
    assert!(said(&lepton, &records, &options).contains("80 x 60 pixels"));
}
