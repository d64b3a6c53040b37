//! Measures the time to calibrate 8 unknowns: of `scenes/calibration.toml` on 100 frames of `scenes/experiment-3.toml`, and
//! of a walking person on 200 frames in the physical model, with the noise of five units each; and to decide whether
//! recordings of that person are the scene's. Prints seconds, and the ratio to one simulation of those frames.

use grideye_frame::{Celsius, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::profile::Profile;
use grideye_scene::{Scene, Simulator};
use grideye_validator::calibrate::{Options, calibrate};
use grideye_validator::{KnownScene, Options as Comparing};
use std::error::Error;
use std::fmt::Write as _;
use std::io;
use std::sync::OnceLock;
use std::time::Duration;

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");
const SENSOR: &str = "ceiling";
const SEEDS: u64 = 5;
/// How often the frames are simulated, for one round's time.
const ROUNDS: u32 = 20;
/// Rows of the person's trajectory, and the time between two of them.
const ROWS: u32 = 2_000;
const ROW_S: f64 = 0.04;

/// A person as a tracker saw it walk; `{...}` are the unknowns.
const PERSON: &str = r#"model = "physical"
[room]
size_mm = [4000, 5000, 2700]
ambient_c = {21.5}

[[agent]]
name = "anna"
person = { height_mm = {1680}, clothing = {1.0} }
trajectory = "walk.csv"

[[sensor]]
name = "ceiling"
preset = "grid-eye"
position_mm = [{2050}, {2450}, {2600}]
elevation_deg = 90
azimuth_deg = 90
tilt_deg = [{2}, {-1.5}]
"#;

/// Key, `[[uncertain]]` keys, guess.
const UNKNOWNS: [(&str, &str, f64); 8] = [
    ("room.ambient_c", "bounds = [18, 25]", 22.5),
    (
        "agent.anna.person.height_mm",
        "bounds = [1400, 2000]",
        1720.0,
    ),
    ("agent.anna.person.clothing", "bounds = [0.3, 2.5]", 1.2),
    (
        "sensor.ceiling.position_mm.x",
        "bounds = [1800, 2200]",
        2000.0,
    ),
    (
        "sensor.ceiling.position_mm.y",
        "bounds = [2300, 2700]",
        2500.0,
    ),
    (
        "sensor.ceiling.position_mm.z",
        "bounds = [2400, 2690]\nsd = 30",
        2580.0,
    ),
    ("sensor.ceiling.tilt_deg.x", "bounds = [-10, 10]", 0.0),
    ("sensor.ceiling.tilt_deg.y", "bounds = [-10, 10]", 0.0),
];

const UNIT: &str = "[noise]\nsigma_c = 0.2\n[common_mode]\nsd_c = 0.08\ncorrelation_s = 4\n[fixed_pattern]\nspread_c = 0.38\n";

struct Case {
    name: &'static str,
    truth: String,
    guess: String,
    unit: Profile,
    frames: usize,
    /// More frames than used, because the end of a walk is left out if the recording may begin later.
    recorded: u32,
}

fn main() -> Result<(), Box<dyn Error>> {
    let white = "[noise]\nsigma_c = 0.2\n";
    let cases = [
        Case {
            name: "calibration.toml",
            truth: read("experiment-3.toml")?,
            guess: read("calibration.toml")?,
            unit: Profile::parse(white, "unit")?,
            frames: 100,
            recorded: 130,
        },
        Case {
            name: "a person",
            truth: person(|_, truth| truth.to_owned()),
            guess: guess(),
            unit: Profile::parse(UNIT, "unit")?,
            frames: 200,
            recorded: 400,
        },
    ];
    println!(
        "                                                          CPU seconds   of one simulation of the frames"
    );
    cases.iter().try_for_each(measure)?;
    for model in ["physical", "paper"] {
        // The live page's ten seconds, two seconds later again; a minute, and a minute that is late and gets advice.
        decide(model, 100, Some(20))?;
        decide(model, 600, None)?;
    }
    Ok(())
}

fn decide(model: &'static str, number: u32, again: Option<u32>) -> Result<(), Box<dyn Error>> {
    let recorded = number + again.unwrap_or(0);
    let case = Case {
        name: model,
        truth: person(|_, truth| truth.to_owned()).replace("physical", model),
        guess: String::new(),
        unit: Profile::parse(UNIT, "unit")?,
        frames: usize::try_from(recorded)?,
        recorded,
    };
    let scene = Scene::parse(&case.truth, "truth.toml", &read)?.scene;
    let simulator = Simulator::new(&scene, SENSOR)?;
    let interval = Duration::from_millis(100);
    let once_s = simulated_s(&simulator, number, interval);
    let records = record(&case, &simulator, interval, 0)?;
    let mut known = KnownScene::new(scene.clone(), SENSOR);
    let late_s = if again.is_none() { 1.5 } else { 0.0 };
    for (from, late_s) in [(0, 0.0), (again.unwrap_or(0), late_s)] {
        let how = Comparing {
            start_s: Some((from * interval).as_secs_f64() + late_s),
            advises: true,
            ..Comparing::default()
        };
        if again.is_none() {
            known = KnownScene::new(scene.clone(), SENSOR);
        }
        let from = usize::try_from(from)?;
        let records = &records[from..from + usize::try_from(number)?];
        let start = cpu_s();
        let found = known.compare(records, &how)?;
        let seconds = cpu_s() - start;
        println!(
            "{:16} {number} frames from {from}, {late_s} s late: {:21}  {seconds:6.2}   {:6.1}",
            case.name,
            found.judgment.verdict.to_string(),
            seconds / once_s
        );
    }
    Ok(())
}

/// Seconds of one simulation of some frames.
fn simulated_s(simulator: &Simulator, frames: u32, interval: Duration) -> f64 {
    let once = cpu_s();
    for _ in 0..ROUNDS {
        for index in 0..frames {
            std::hint::black_box(simulator.image(index * interval));
        }
    }
    (cpu_s() - once) / f64::from(ROUNDS)
}

fn measure(case: &Case) -> Result<(), Box<dyn Error>> {
    let options = Options {
        frames: Some(case.frames),
        ..Options::default()
    };
    let scene = Scene::parse(&case.truth, "truth.toml", &read)?.scene;
    let simulator = Simulator::new(&scene, SENSOR)?;
    let interval = scene.duration() / case.recorded;
    let frames = u32::try_from(case.frames)?;
    let once_s = simulated_s(&simulator, frames, scene.duration() / frames);
    let mut most = 0.0_f64;
    for seed in 0..SEEDS {
        let records = record(case, &simulator, interval, seed)?;
        let start = cpu_s();
        let scene = (case.guess.as_str(), "guess.toml");
        let found = calibrate(&records, scene, &read, SENSOR, &options, &mut |_| ())?;
        let seconds = cpu_s() - start;
        most = most.max(seconds);
        println!(
            "{:16} unit {seed}: {} unknowns, {} frames, {:4} simulations  {seconds:6.2}   {:6.1}",
            case.name,
            found.found.len(),
            found.frames,
            found.evaluations,
            seconds / once_s
        );
        if std::env::args().any(|word| word == "values") {
            println!("{}", found.text());
        }
    }
    println!("{}: at most {most:.2} s on one core", case.name);
    Ok(())
}

/// This thread's CPU time, independent of the machine's other load; 0 if the kernel does not report it.
fn cpu_s() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let told = told.and_then(|text| text.split(' ').next()?.parse().ok());
    1e-9 * told.unwrap_or(0.0)
}

fn read(name: &str) -> io::Result<String> {
    if name == "walk.csv" {
        return Ok(walk());
    }
    std::fs::read_to_string(format!("{SCENES}/{name}"))
}

/// Round the room and across it, at 0.5 to 1 m/s.
fn walk() -> String {
    static TEXT: OnceLock<String> = OnceLock::new();
    TEXT.get_or_init(made_walk).clone()
}

fn made_walk() -> String {
    let mut text = "t_s,x_mm,y_mm,z_mm\n".to_owned();
    for row in 0..ROWS {
        let time_s = f64::from(row) * ROW_S;
        let x_mm = 2000.0 + 1300.0 * (0.47 * time_s).sin();
        let y_mm = 2500.0 + 1400.0 * (0.31 * time_s + 0.5).sin();
        let _ = writeln!(text, "{time_s:.3},{x_mm:.1},{y_mm:.1},0");
    }
    text
}

/// The scene with each `{number}` replaced, given its place in [`UNKNOWNS`].
fn person(number: impl Fn(usize, &str) -> String) -> String {
    let order = [0, 1, 2, 3, 4, 5, 6, 7];
    let mut text = String::new();
    let mut rest = PERSON;
    let mut places = order.into_iter();
    while let Some((before, after)) = rest.split_once('{') {
        text.push_str(before);
        match after.split_once('}') {
            Some((word, behind)) if word.parse::<f64>().is_ok() => {
                text.push_str(&number(places.next().unwrap_or(0), word));
                rest = behind;
            }
            _ => {
                text.push('{');
                rest = after;
            }
        }
    }
    text.push_str(rest);
    text
}

fn guess() -> String {
    let mut text = person(|place, _| UNKNOWNS[place].2.to_string());
    for (key, keys, _) in UNKNOWNS {
        let _ = write!(text, "\n[[uncertain]]\nkey = \"{key}\"\n{keys}\n");
    }
    text
}

/// The scene as a unit sees it, rounded like the chip, in frames evenly spaced.
fn record(
    case: &Case,
    simulator: &Simulator,
    interval: Duration,
    seed: u64,
) -> Result<Vec<Record>, Box<dyn Error>> {
    let mut records = Vec::new();
    for index in 0..case.recorded {
        let time: Duration = index * interval;
        let image = simulator.image(time).to_frame(Celsius::new(25.0));
        let image = image.ok_or("the sensor has no 8 x 8 pixels")?;
        let tick = u64::try_from(time.as_millis() / 100)?;
        let frame = case.unit.apply(seed, tick, time, image);
        let mut pixels = [grideye_frame::PixelWord(0); grideye_frame::PIXELS];
        for (word, pixel) in pixels.iter_mut().zip(frame.pixels) {
            *word = grideye_frame::word::pixel_word(pixel)?;
        }
        let thermistor = ThermistorWord(400);
        records.push(Record {
            seq: u64::from(index),
            stamp: Stamp {
                t_boot_ns: u64::try_from(time.as_nanos())?,
                t_utc_ns: 0,
                clock: ClockState::Unsynced,
            },
            reading: Reading::Frame(RecordedFrame {
                thermistor: Some(thermistor),
                pixels,
            }),
        });
    }
    Ok(records)
}
