//! Pins what comparisons say: of each shipped scene with its own recording and with the same recording mirrored, and of real
//! frames with two scenes. A commit that changes `verdicts.json` says why.
//!
//! `GRIDEYE_WRITE_GOLDEN=1 cargo test --release -p grideye-validator --test golden` writes the file again.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_frame::{Celsius, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::{Scene, Sensor, Simulator};
use grideye_validator::{Comparison, Finding, Options, Verdict, compare_scene};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

const FRAMES: u32 = 60;

/// The paper's measures, and what the report's readers use beside them.
const SCORES: [&str; 9] = [
    "correlation",
    "entropy_real_grey",
    "entropy_simulated_grey",
    "joint_entropy_grey",
    "mutual_information_grey",
    "image_similarity",
    "rmse",
    "bias",
    "centroid_error_pixels",
];

#[test]
fn what_comparisons_say_is_as_pinned() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/verdicts.json");
    let mut said = Map::new();
    for path in shipped_scenes() {
        let (name, scene) = parse(&path);
        let is_grid_eye = |sensor: &&Sensor| (sensor.columns, sensor.rows) == (8, 8);
        let Some(sensor) = scene.sensors().iter().find(is_grid_eye) else {
            continue;
        };
        let sensor = &sensor.name;
        let (start_s, own) = record(&scene, sensor);
        let mirrored: Vec<Record> = own.iter().cloned().map(mirror).collect();
        for (kind, records) in [("own", &own), ("mirrored", &mirrored)] {
            said.insert(
                format!("{name}, {kind}"),
                compared(records, &scene, sensor, start_s),
            );
        }
    }
    for (session, scene) in [
        ("Session2_2021-07-01_RoomB_v2", "counting"),
        ("Session3_2021-07-06_RoomA_v2", "people"),
    ] {
        let records = real_frames(session);
        let (_, scene) = parse(&root().join(format!("scenes/{scene}.toml")));
        let sensor = &scene.sensors()[0].name;
        said.insert(session.to_owned(), compared(&records, &scene, sensor, 0.0));
    }
    if std::env::var_os("GRIDEYE_WRITE_GOLDEN").is_some() {
        std::fs::write(&path, format!("{:#}\n", Value::Object(said))).unwrap();
        return;
    }
    let pinned: Map<String, Value> =
        serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    let names = |of: &Map<String, Value>| of.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&pinned), names(&said));
    let changed: Vec<String> = said
        .iter()
        .filter(|(name, now)| pinned[*name] != **now)
        .map(|(name, now)| format!("{name}\n  pinned {}\n  now    {now}", pinned[name]))
        .collect();
    assert!(
        changed.is_empty(),
        "{} of {} changed:\n{}",
        changed.len(),
        said.len(),
        changed.join("\n")
    );
}

/// A minute of each, or all of it if it takes longer at 1 Hz, by units that nobody measured. `GRIDEYE_ALL_SEEDS=1` draws more
/// units, takes all sensors and the warm prints; `GRIDEYE_CASES=TEXT` keeps the scenes whose names begin with that.
#[test]
fn what_ships_agrees_with_its_own_recording_or_says_why_it_cannot_be_told() {
    let all = std::env::var_os("GRIDEYE_ALL_SEEDS").is_some();
    let asked = std::env::var("GRIDEYE_CASES").unwrap_or_default();
    let (units, sensors_most) = if all { (20, usize::MAX) } else { (1, 1) };
    // Three standard deviations beyond the 1.5 % that are refused by design, and as many that cannot tell.
    let most = if all { 3 } else { 0 };
    let mut wrong = Vec::new();
    for path in shipped_scenes() {
        let (name, scene) = parse(&path);
        let sensors = scene.sensors().iter();
        let sensors = sensors.filter(|sensor| (sensor.columns, sensor.rows) == (8, 8));
        // Two minutes of warm prints take half as long as all others.
        let is_short = all || !asked.is_empty() || name != "warm-print";
        let sensors = sensors.filter(|_| is_short && name.starts_with(&asked));
        for sensor in sensors.take(sensors_most) {
            let is_untold = is_untold(&path, &sensor.name);
            let [agree, disagree, cannot_tell] = verdicts(&scene, sensor, units);
            let found = format!(
                "{name}, {}: {agree} agree, {disagree} disagree, {cannot_tell} cannot tell",
                sensor.name
            );
            println!("{found}");
            let is_agreed = agree + most >= units;
            // Nor may it say so of what it can tell.
            if disagree > most || !is_untold && !is_agreed || all && is_untold && agree == units {
                wrong.push(found);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Whether the first lines of a scene say that it cannot be told by this sensor.
fn is_untold(path: &Path, sensor: &str) -> bool {
    let text = std::fs::read_to_string(path).unwrap();
    let head = text.lines().take_while(|line| line.starts_with('#'));
    let head: String = head.map(|line| line.trim_start_matches('#')).collect();
    let said = head.split_once("cannot tell this scene");
    said.is_some_and(|(_, rest)| {
        let of = rest.split(':').next().unwrap();
        !of.contains("by sensor") || of.split(' ').any(|word| word == sensor)
    })
}

/// How many recordings by different units agree, disagree, and cannot tell.
fn verdicts(scene: &Scene, sensor: &Sensor, units: u64) -> [u64; 3] {
    const MINUTE: u32 = 600;
    let mut verdicts = [0; 3];
    for seed in 0..units {
        let frames = if scene.is_static() {
            MINUTE
        } else {
            2 * MINUTE
        };
        // A profile has a unit already.
        let unit_c = match &sensor.profile {
            Some(_) => [0.0; PIXELS],
            None => unit_c(seed),
        };
        let records = recorded(scene, &sensor.name, 0, frames, unit_c);
        let options = Options {
            start_s: Some(0.0),
            seed,
            shuffles: 1,
            ..Options::default()
        };
        let compared = compare_scene(&records, scene, &sensor.name, &options);
        let judgment = compared.unwrap().judgment;
        verdicts[match judgment.verdict {
            Verdict::Agrees => 0,
            Verdict::Disagrees => 1,
            Verdict::CannotTell => 2,
        }] += 1;
        if judgment.verdict != Verdict::Agrees {
            println!("    {seed}: {}", judgment.headline);
        }
    }
    verdicts
}

/// What a unit adds to each pixel: the middle of what public recordings show, 0.15 to 0.25 °C.
fn unit_c(seed: u64) -> [f32; PIXELS] {
    let mut random = ChaCha8Rng::seed_from_u64(600 + seed);
    std::array::from_fn(|_| {
        let draw: f32 = StandardNormal.sample(&mut random);
        0.2 * draw
    })
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn shipped_scenes() -> Vec<PathBuf> {
    let folder = std::fs::read_dir(root().join("scenes")).unwrap();
    let mut paths: Vec<PathBuf> = folder.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| {
        path.extension()
            .is_some_and(|extension| extension == "toml")
    });
    paths.sort();
    assert!(paths.len() > 20, "{paths:?}");
    paths
}

fn parse(path: &Path) -> (String, Scene) {
    let text = std::fs::read_to_string(path).unwrap();
    let folder = path.parent().unwrap().to_owned();
    let files = move |relative: &str| std::fs::read_to_string(folder.join(relative));
    let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
    let scene = Scene::parse(&text, &name, &files).unwrap();
    (name, scene.scene)
}

/// What the scene's sensor records from a third of the scene on, and the second at which that begins.
fn record(scene: &Scene, sensor: &str) -> (f64, Vec<Record>) {
    let of = scene.sensor(sensor).unwrap();
    let first = match scene.is_static() {
        true => 0,
        false => u32::try_from(scene.frame_count(of)).unwrap() / 3,
    };
    let start_s = of.frame_time(first).as_secs_f64();
    (
        start_s,
        recorded(scene, sensor, first, FRAMES, [0.0; PIXELS]),
    )
}

/// At most this many frames from one of the scene's on, with what the unit adds to each pixel, °C.
fn recorded(
    scene: &Scene,
    sensor: &str,
    first: u32,
    frames: u32,
    unit_c: [f32; PIXELS],
) -> Vec<Record> {
    let simulator = Simulator::new(scene, sensor).unwrap();
    let of = scene.sensor(sensor).unwrap();
    let row = |index: u32| {
        let image = simulator.noisy(of.frame_time(first + index), 11);
        let image = image.to_frame(Celsius::new(25.0)).unwrap();
        let pixels = std::array::from_fn(|pixel| {
            let celsius = Celsius::new(image.pixels[pixel].get() + unit_c[pixel]);
            grideye_frame::word::pixel_word(celsius).unwrap()
        });
        let thermistor = Some(ThermistorWord(400));
        let t_boot_ns = 5_000_000_000 + u64::try_from(of.frame_time(index).as_nanos()).unwrap();
        Record {
            seq: u64::from(index),
            stamp: Stamp {
                t_boot_ns,
                t_utc_ns: 0,
                clock: ClockState::Unsynced,
            },
            reading: Reading::Frame(RecordedFrame { thermistor, pixels }),
        }
    };
    let frames = match scene.is_static() {
        true => frames,
        false => frames.min(u32::try_from(scene.frame_count(of)).unwrap() - first),
    };
    (0..frames).map(row).collect()
}

fn mirror(record: Record) -> Record {
    let reading = record.reading.map(|mut raw| {
        raw.pixels.chunks_mut(8).for_each(<[PixelWord]>::reverse);
        raw
    });
    Record { reading, ..record }
}

/// Real frames in which somebody walks, and an empty room before.
fn real_frames(session: &str) -> Vec<Record> {
    let name = format!("{session}.csv");
    let file = std::fs::File::open(root().join("recordings/linaige").join(&name)).unwrap();
    let rows = grideye_import::open(file, &name, &Default::default()).unwrap();
    rows.map(|row| row.unwrap().record)
        .skip(740)
        .take(200)
        .collect()
}

/// What a user reads first, and the scores that the paper and the report have.
fn compared(records: &[Record], scene: &Scene, sensor: &str, start_s: f64) -> Value {
    let options = Options {
        start_s: Some(start_s),
        seed: 1,
        shuffles: 20,
        ..Options::default()
    };
    match compare_scene(records, scene, sensor, &options) {
        Ok(comparison) => said(&comparison),
        Err(error) => json!({ "error": error.to_string() }),
    }
}

fn said(comparison: &Comparison) -> Value {
    let judgment = &comparison.judgment;
    let scores = comparison
        .scores
        .iter()
        .filter(|score| SCORES.contains(&score.measure.name()));
    let scores: Map<String, Value> = scores
        .map(|score| {
            (
                score.measure.name().to_owned(),
                json!([score.value, score.blank, score.ceiling].map(rounded)),
            )
        })
        .collect();
    let decision = comparison.decision.as_ref().unwrap();
    let untold = decision.alternatives.iter();
    let untold = untold.filter(|one| one.finding() != Finding::Excluded);
    json!({
        "verdict": judgment.verdict,
        "headline": judgment.headline,
        "next_step": judgment.next_step,
        "p": rounded(Some(decision.right)),
        "contrasts": decision.contrasts.iter().map(|one| rounded(Some(one.found))).collect::<Vec<_>>(),
        "untold": untold.map(|one| &one.what).collect::<Vec<_>>(),
        "value, blank, ceiling": scores,
    })
}

fn rounded(value: Option<f64>) -> Option<f64> {
    value.map(|value| (value * 1e4).round() / 1e4)
}
