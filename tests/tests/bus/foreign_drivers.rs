//! Third-party Python drivers, as published, on the emulated sensor.
//!
//! [`DRIVERS`] holds each one's decoding of the register bytes, with its known faults. The tests compare the driver's
//! values with that decoding, and the decoding with the truth (AMG88 spec §4-11-9, §4-11-11).

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::emulated::{Words, pixel_c, recording, thermistor_c};
use grideye_tests::emulated::{run_behind_socket, run_emulated};
use grideye_tests::programs::{self, Ended, grideye, root, run};
use grideye_tests::python;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Row and column, from 0, of pixels 1 to 64 in a driver's frame.
type Place = fn(usize) -> (usize, usize);

/// A driver and its decoding of the bytes.
struct Driver {
    /// Package and version.
    name: &'static str,
    /// Script of `tests/python` and its arguments.
    script: &'static [&'static str],
    place: Place,
    /// Decodes its thermistor in °C; `None` if the test does not read it.
    thermistor: Option<fn(u16) -> f64>,
    /// Whether it takes its bus from a package that the socket client can replace. The others open /dev/i2c-N
    /// themselves.
    has_socket: bool,
}

impl Driver {
    fn can(&self, way: Way) -> bool {
        way != Way::Socket || self.has_socket
    }
}

/// How a Python program reaches the sensor: `/dev/i2c-1`, or a Unix socket behind the one-file client.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Device,
    Socket,
}

impl Way {
    const ALL: [Self; 2] = [Self::Device, Self::Socket];

    fn run(self, source: &[&str], program: &Command) -> Ended {
        match self {
            Self::Device => run_emulated(source, program),
            Self::Socket => run_behind_socket(source, program),
        }
    }
}

/// The specification's order: pixels 1 to 8 are the first row.
fn in_order(pixel: usize) -> (usize, usize) {
    (pixel / 8, pixel % 8)
}

/// Rotated by 180°.
fn turned(pixel: usize) -> (usize, usize) {
    (7 - pixel / 8, 7 - pixel % 8)
}

/// melopero's thermistor: it takes the last four bits as one over their value, not as sixteenths.
fn one_over_the_fraction(word: u16) -> f64 {
    let whole = f64::from((word & 0x7FF) >> 4);
    let nibble = f64::from(word & 0xF);
    let magnitude = whole + if nibble == 0.0 { 0.0 } else { 1.0 / nibble };
    if word & 0x800 == 0 {
        magnitude
    } else {
        -magnitude
    }
}

const DRIVERS: [Driver; 6] = [
    Driver {
        name: "adafruit-circuitpython-amg88xx 1.2.28, adafruit-extended-bus 1.0.2",
        script: &["circuitpython.py", "extended"],
        place: in_order,
        thermistor: Some(thermistor_c),
        has_socket: false,
    },
    Driver {
        name: "adafruit-circuitpython-amg88xx 1.2.28, Blinka 10.0.0 board.I2C()",
        script: &["circuitpython.py", "board"],
        place: in_order,
        thermistor: Some(thermistor_c),
        has_socket: true,
    },
    Driver {
        name: "melopero-amg8833 0.2.1, smbus2 0.6.1",
        script: &["melopero.py"],
        place: in_order,
        thermistor: Some(one_over_the_fraction),
        has_socket: true,
    },
    Driver {
        name: "grideye-driver 0.1.1, smbus2 0.6.1",
        script: &["grideye_driver.py"],
        place: turned,
        thermistor: Some(thermistor_c),
        has_socket: true,
    },
    Driver {
        name: "smbus2 0.6.1, i2c_rdwr",
        script: &["burst.py", "smbus2"],
        place: in_order,
        thermistor: None,
        has_socket: true,
    },
    Driver {
        name: "Adafruit-PureIO 1.1.12, one block",
        script: &["burst.py", "pureio"],
        place: in_order,
        thermistor: None,
        has_socket: false,
    },
];

/// Panasonic's printed vectors of the pixel word (AMG88 spec §4-11-11), and both ends of the 12-bit range.
const PRINTED: [(u16, f64); 9] = [
    (0x1F4, 125.0),
    (0x064, 25.0),
    (0x001, 0.25),
    (0x000, 0.0),
    (0xFFF, -0.25),
    (0xF9C, -25.0),
    (0xF24, -55.0),
    (0x7FF, 511.75),
    (0x800, -512.0),
];

/// Panasonic's printed vectors of the thermistor word (AMG88 spec §4-11-9) and one in between, with the true values.
const THERMISTORS: [(u16, f64); 5] = [
    (0x190, 25.0),
    (0x191, 25.0625),
    (0x004, 0.25),
    (0x804, -0.25),
    (0x940, -20.0),
];

/// The printed vectors, then 55 other distinct words, so that every place is identifiable.
fn printed_and_distinct() -> [u16; 64] {
    std::array::from_fn(|pixel| match PRINTED.get(pixel) {
        Some((word, _)) => *word,
        None => u16::try_from(0x105 + 7 * pixel).unwrap(),
    })
}

/// A freezing room: every pixel below zero, all different.
fn all_below_zero() -> [u16; 64] {
    std::array::from_fn(|pixel| u16::try_from(0xFFF - 3 * pixel).unwrap())
}

/// The answer of a driver's program, which must have succeeded.
fn answer(ended: &Ended, name: &str) -> Value {
    assert_eq!(ended.code, 0, "{name}: {ended:?}");
    serde_json::from_str(&ended.stdout).unwrap()
}

/// A frame of a driver, in the specification's order.
fn in_specified_order(frame: &Value, place: Place) -> Vec<f64> {
    assert_eq!(frame.as_array().unwrap().len(), 8, "{frame}");
    (0..64)
        .map(|pixel| {
            let (row, column) = place(pixel);
            frame[row][column].as_f64().unwrap()
        })
        .collect()
}

/// Runs a driver's program by one way and returns its answer; `None` if the Python drivers are left out.
fn ask(way: Way, source: &[&str], script: &[&str]) -> Option<Value> {
    let command = python::script(script[0], &script[1..], "Python drivers of other authors")?;
    let ended = way.run(source, &command);
    Some(answer(&ended, &script.join(" ")))
}

fn ask_for_a_frame(way: Way, source: &[&str], driver: &Driver) -> Option<Value> {
    ask(way, source, &[driver.script, &["frame"]].concat())
}

fn path(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn the_words_mean_what_panasonic_printed() {
    for (word, printed) in PRINTED {
        assert!((pixel_c(word) - printed).abs() < 1e-9, "{word:#05X}");
    }
    for (word, printed) in THERMISTORS {
        assert!((thermistor_c(word) - printed).abs() < 1e-9, "{word:#05X}");
    }
}

/// Every driver, on the printed vectors and on frames below zero, with a thermistor above and below zero.
#[test]
fn each_driver_gives_what_its_own_decoding_makes_of_the_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let frames = [
        ("printed.csv", printed_and_distinct(), 0x191),
        ("frost.csv", all_below_zero(), 0x940),
    ];
    for (name, pixels, thermistor) in frames {
        let words = Words { pixels, thermistor };
        let file = recording(folder.path(), name, [words]);
        for way in Way::ALL {
            for driver in DRIVERS.iter().filter(|driver| driver.can(way)) {
                let source = ["--recording", path(&file)];
                let Some(answer) = ask_for_a_frame(way, &source, driver) else {
                    return;
                };
                holds(driver, way, &words, &answer);
            }
        }
    }
}

/// Compares an answer with the driver's decoding, and prints both beside the truth.
fn holds(driver: &Driver, way: Way, words: &Words, answer: &Value) {
    let given = in_specified_order(&answer["frame"], driver.place);
    let truth: Vec<f64> = words.pixels.iter().map(|word| pixel_c(*word)).collect();
    assert_eq!(given, truth, "{} by {way:?}", driver.name);
    let Some(decode) = driver.thermistor else {
        assert_eq!(answer["high_nibbles"], 0, "bits 7 to 4 of the high bytes");
        return;
    };
    let thermistor = answer["thermistor"].as_f64().unwrap();
    let own = decode(words.thermistor);
    let truth = thermistor_c(words.thermistor);
    println!(
        "{:<68} {way:?}: thermistor {:#05X} given {thermistor}, its decoding {own}, true {truth}",
        driver.name, words.thermistor
    );
    assert!((thermistor - own).abs() < 1e-9, "{}", driver.name);
}

/// A script around Adafruit's library prints one frame per line; the import becomes a recording with the same words.
#[test]
fn rows_that_adafruits_library_gives_are_imported_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let words = Words {
        pixels: printed_and_distinct(),
        thermistor: 0x191,
    };
    let shown = recording(folder.path(), "shown.csv", [words]);
    let script = ["board", "rows", "5"];
    let what = "rows that Adafruit's library prints";
    let Some(command) = python::script("circuitpython.py", &script, what) else {
        return;
    };
    let ended = Way::Socket.run(&["--recording", path(&shown)], &command);
    assert_eq!(
        (ended.code, ended.stdout.lines().count()),
        (0, 5),
        "{ended:?}"
    );
    let (rows, imported) = (
        folder.path().join("rows.txt"),
        folder.path().join("imported.csv"),
    );
    std::fs::write(&rows, &ended.stdout).unwrap();
    // Words that tell all rows apart are hotter than any room, and the unit is asked for.
    let unit = ["--columns", "unit=celsius"];
    let converted = run(grideye().arg("convert").args([&rows, &imported]).args(unit));
    assert_eq!(converted.code, 0, "{converted:?}");
    let text = std::fs::read_to_string(imported).unwrap();
    let truth: Vec<f64> = words.pixels.iter().map(|word| pixel_c(*word)).collect();
    assert_eq!(text.lines().count(), 6, "{text}");
    for row in text.lines().skip(1) {
        let cells: Vec<&str> = row.split(',').skip(9).collect();
        let pixels: Vec<f64> = cells[1..]
            .iter()
            .map(|cell| cell.parse().unwrap())
            .collect();
        assert_eq!((cells[0], pixels), ("", truth.clone()));
    }
}

/// A room with one standing person in the top left quarter of the image: the person stands to the right and front of
/// the sensor's axis, which azimuth -90 shows at the left and top.
fn standing_person(folder: &Path, ambient_c: f64, person_c: f64) -> PathBuf {
    let file = folder.join(format!("standing{ambient_c}.toml"));
    let text = format!(
        "[room]\nsize_mm = [4000, 4000, 2700]\nambient_c = {ambient_c:?}\n\
         [[agent]]\nname = \"person\"\nsize_mm = [300, 300, 1750]\ntemperature_c = {person_c:?}\nposition_mm = [2300, 1700, 0]\n\
         [[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [2000, 2000, 2700]\n\
         elevation_deg = 90\nazimuth_deg = -90\nnoise_sigma_c = 0\n"
    );
    std::fs::write(&file, text).unwrap();
    file
}

/// The simulator's own frame of a static scene without noise.
fn simulated(folder: &Path, scene: &Path) -> Vec<f64> {
    let out = folder.join("simulated.csv");
    let ended = run(grideye().arg("simulate").arg(scene).arg("--out").arg(&out));
    assert_eq!(ended.code, 0, "{ended:?}");
    let text = std::fs::read_to_string(out).unwrap();
    let row = text.lines().nth(1).unwrap();
    row.split(',')
        .skip(10)
        .map(|cell| cell.parse().unwrap())
        .collect()
}

/// The body extends from 150 to 450 mm beside the axis, with its head 950 mm and its feet 2700 mm below the sensor. It
/// appears between atan(150/2700) = 3° and atan(450/950) = 25° off the axis, to the left and top.
fn is_of_the_person(pixel: usize) -> bool {
    pixel / 8 < 4 && pixel % 8 < 4
}

/// In a warm room and one below zero, the frame matches the scene, and the warm pixels are where the person stands.
#[test]
fn each_driver_sees_the_person_where_the_person_stands() {
    let folder = tempfile::tempdir().unwrap();
    for (ambient_c, person_c) in [(20.0, 32.0), (-10.0, 20.0)] {
        let scene = standing_person(folder.path(), ambient_c, person_c);
        let truth = simulated(folder.path(), &scene);
        let warm: Vec<usize> = (0..64)
            .filter(|pixel| truth[*pixel] > ambient_c + 1.0)
            .collect();
        assert!(
            warm.len() >= 4 && warm.iter().all(|pixel| is_of_the_person(*pixel)),
            "{warm:?}"
        );
        assert!((truth[63] - ambient_c).abs() < 0.3, "{truth:?}");
        for way in Way::ALL {
            for driver in DRIVERS.iter().filter(|driver| driver.can(way)) {
                let source = ["--scene", path(&scene)];
                let Some(answer) = ask_for_a_frame(way, &source, driver) else {
                    return;
                };
                let given = in_specified_order(&answer["frame"], driver.place);
                assert_eq!(given, truth, "{} by {way:?}", driver.name);
            }
        }
    }
}

/// The driver's default is 0x69: the scan finds a sensor at 0x68, and the driver gets no answer.
#[test]
fn circuitpython_finds_the_sensor_and_hears_that_nobody_is_at_the_other_address() {
    for way in Way::ALL {
        let script = ["circuitpython.py", "board", "frame"];
        let source = ["--scene", "scenes/experiment-1.toml", "--address"];
        let Some(there) = ask(way, &[&source[..], &["0x69"]].concat(), &script) else {
            return;
        };
        assert_eq!(there["scan"], serde_json::json!([0x69]));

        let command = python::script(script[0], &script[1..], "").unwrap();
        let source = [&source[..], &["0x68"]].concat();
        let ended = way.run(&source, &command);
        assert_eq!(ended.code, 1, "{ended:?}");
        let heard = "ValueError: No I2C device at address: 0x69";
        assert!(ended.stderr.contains(heard), "{ended:?}");
    }
}

#[test]
fn sleep_and_wake_of_grideye_driver() {
    let folder = tempfile::tempdir().unwrap();
    let words = Words {
        pixels: all_below_zero(),
        thermistor: 0x190,
    };
    let file = recording(folder.path(), "frost.csv", [words]);
    let truth: Vec<f64> = words.pixels.iter().map(|word| pixel_c(*word)).collect();
    for way in Way::ALL {
        let source = ["--recording", path(&file)];
        let Some(answer) = ask(way, &source, &["grideye_driver.py", "sleep"]) else {
            return;
        };
        // Created, woken, exited, woken by call: the driver recognizes sleep by 2048 °C, which is 00 80 at 0x0E.
        assert_eq!(
            answer["states"],
            serde_json::json!([true, false, true, false])
        );
        let asleep = in_specified_order(&answer["asleep"], turned);
        assert!(
            asleep.iter().all(|pixel| *pixel == 0.0),
            "reads in sleep are no frame: {asleep:?}"
        );
        assert_eq!(in_specified_order(&answer["awake"], turned), truth);
        assert_eq!(in_specified_order(&answer["again"], turned), truth);
    }
}

#[test]
fn sleep_wake_and_rate_of_melopero() {
    let folder = tempfile::tempdir().unwrap();
    let words = Words {
        pixels: printed_and_distinct(),
        thermistor: 0x190,
    };
    let file = recording(folder.path(), "printed.csv", [words]);
    for way in Way::ALL {
        let source = ["--recording", path(&file)];
        let Some(answer) = ask(way, &source, &["melopero.py", "modes"]) else {
            return;
        };
        assert_eq!(answer["fps"], serde_json::json!([1, 10]));
        let asleep = in_specified_order(&answer["asleep"], in_order);
        assert!(asleep.iter().all(|pixel| *pixel == 0.0), "{asleep:?}");
        let truth: Vec<f64> = words.pixels.iter().map(|word| pixel_c(*word)).collect();
        assert_eq!(in_specified_order(&answer["awake"], in_order), truth);
    }
}

/// grideye-driver writes 0x20 to the key register instead of 0x07 (reference, 2.5): the chip must not average.
#[test]
fn the_moving_average_of_grideye_driver_has_no_effect_as_on_the_chip() {
    for way in Way::ALL {
        let source = ["--scene", "scenes/experiment-1.toml"];
        let Some(answer) = ask(way, &source, &["grideye_driver.py", "average"]) else {
            return;
        };
        assert_eq!(answer["moving_average"], false, "{answer}");
        assert_eq!(answer["frame_rate"], "high");
    }
}

#[test]
fn interrupts_of_melopero_mark_the_person_and_clear() {
    let folder = tempfile::tempdir().unwrap();
    let scene = standing_person(folder.path(), -10.0, 20.0);
    let truth = simulated(folder.path(), &scene);
    for way in Way::ALL {
        let source = ["--scene", path(&scene)];
        let script = ["melopero.py", "interrupts", "-5", "-30", "0"];
        let Some(answer) = ask(way, &source, &script) else {
            return;
        };
        assert_eq!(
            (&answer["tripped"], &answer["cleared"]),
            (&true.into(), &true.into())
        );
        for (pixel, true_c) in truth.iter().enumerate() {
            let (row, column) = in_order(pixel);
            // "Greater than" the level (AMG88 spec §4-11-8).
            assert_eq!(
                answer["table"][row][column],
                *true_c > -5.0,
                "pixel {}",
                pixel + 1
            );
        }
    }
}

/// A person enters at the room's left, which is the image's right, crosses, and leaves.
fn crossing_person(folder: &Path) -> PathBuf {
    let file = folder.join("crossing.toml");
    let text = "[room]\nsize_mm = [8000, 4000, 2700]\nambient_c = -10.0\n\
         [[agent]]\nname = \"person\"\nsize_mm = [300, 300, 1750]\ntemperature_c = 25.0\n\
         trajectory = \"crossing.csv\"\nspeed_mm_per_s = 2000\n\
         [[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [4000, 2000, 2700]\n\
         elevation_deg = 90\nazimuth_deg = -90\nnoise_sigma_c = 0.1\n";
    std::fs::write(&file, text).unwrap();
    std::fs::write(
        folder.join("crossing.csv"),
        "x_mm,y_mm,z_mm\n400,2000,0\n7600,2000,0\n",
    )
    .unwrap();
    file
}

#[test]
fn interrupts_of_grideye_driver_trip_for_the_person_and_clear() {
    let folder = tempfile::tempdir().unwrap();
    let scene = crossing_person(folder.path());
    for way in Way::ALL {
        let source = ["--scene", path(&scene)];
        let script = ["grideye_driver.py", "interrupts", "-5", "-40", "1", "4.5"];
        let Some(answer) = ask(way, &source, &script) else {
            return;
        };
        assert_eq!(
            answer["config"],
            serde_json::json!([-5.0, -40.0, 1.0, true, true]),
            "the levels read back as written, also below zero"
        );
        let seen = answer["seen"].as_array().unwrap();
        let flags: Vec<bool> = seen.iter().map(|look| look[0].as_bool().unwrap()).collect();
        let changes = flags.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(
            !flags[0] && flags.contains(&true) && !flags[flags.len() - 1] && changes == 2,
            "nobody, the person, nobody: {flags:?}"
        );
        let columns: Vec<f64> = seen.iter().filter_map(middle_column).collect();
        assert!(
            columns.first().unwrap() < &2.0 && columns.last().unwrap() > &5.0,
            "from the room's left to its right, which is left to right in the driver's rotated image: {columns:?}"
        );
    }
}

/// A walking person makes drivers that read a frame in several transactions mix two frames: each pixel alone must still
/// belong to this scene, and the walk must be visible.
#[test]
fn each_driver_sees_someone_walk_through() {
    let folder = tempfile::tempdir().unwrap();
    let scene = crossing_person(folder.path());
    for way in Way::ALL {
        std::thread::scope(|scope| {
            let drivers = DRIVERS.iter().filter(|driver| driver.can(way));
            for driver in drivers.filter(|driver| driver.thermistor.is_some()) {
                scope.spawn(|| sees_the_walk(driver, way, &scene));
            }
        });
    }
}

fn sees_the_walk(driver: &Driver, way: Way, scene: &Path) {
    let source = ["--scene", path(scene)];
    let script = [driver.script, &["walk", "4"]].concat();
    let Some(answer) = ask(way, &source, &script) else {
        return;
    };
    let frames = answer["frames"].as_array().unwrap();
    let frames: Vec<Vec<f64>> = frames
        .iter()
        .map(|frame| in_specified_order(frame, driver.place))
        .collect();
    assert!(frames.len() >= 10, "{}: {}", driver.name, frames.len());
    // Room and body are at -10 and 25 °C, plus six sigma of the scene's noise and one step of the chip.
    let is_strange = |pixel: &f64| !(-11.0..=26.0).contains(pixel);
    let strange: Vec<f64> = frames.concat().into_iter().filter(is_strange).collect();
    // Of a driver that reads bytes: the upper byte of below zero and the lower of above, or the other way round.
    let is_mixed = |pixel: &f64| (-64.0..-37.0).contains(pixel) || (53.0..64.0).contains(pixel);
    let reads_bytes = driver.script == ["melopero.py"];
    let mixed_most = if reads_bytes { frames.len() } else { 0 };
    let is_right = strange.len() <= mixed_most && strange.iter().all(is_mixed);
    assert!(is_right, "{}: {strange:?}", driver.name);
    let columns: Vec<f64> = frames
        .iter()
        .filter_map(|frame| warm_column(frame))
        .collect();
    assert!(
        columns.first().unwrap() > &5.0 && columns.last().unwrap() < &2.0,
        "{}: from the room's left, which is the image's right: {columns:?}",
        driver.name
    );
}

/// The mean column of the pixels above -5 °C.
fn warm_column(frame: &[f64]) -> Option<f64> {
    let warm = (0..64).filter(|pixel| frame[*pixel] > -5.0);
    mean(&warm.map(|pixel| pixel % 8).collect::<Vec<_>>())
}

/// The mean column of the pixels with their interrupt bit set.
fn middle_column(look: &Value) -> Option<f64> {
    let set: Vec<usize> = (0..64)
        .filter(|pixel| look[1][pixel / 8][pixel % 8] == true)
        .map(|pixel| pixel % 8)
        .collect();
    mean(&set)
}

fn mean(columns: &[usize]) -> Option<f64> {
    let sum = u32::try_from(columns.iter().sum::<usize>()).unwrap();
    let count = u32::try_from(columns.len()).unwrap();
    (count > 0).then(|| f64::from(sum) / f64::from(count))
}

/// The example of EMULATE.md, run by a shell as it stands.
#[test]
fn the_documented_python_driver_reads_the_emulated_sensor() {
    let what = "the Python driver of EMULATE.md";
    let Some(packages) = python::programs("python", "tests/python/requirements.txt", what) else {
        return;
    };
    let page = std::fs::read_to_string(root().join("crates/grideye/EMULATE.md")).unwrap();
    let (_, example) = page.split_once("```bash smbus2\n").unwrap();
    let (example, _) = example.split_once("```").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let example = example.replace("/tmp/", &format!("{}/", folder.path().display()));
    let programs = programs::folder().canonicalize().unwrap();
    let path = std::env::var("PATH").unwrap();
    let path = format!("{}:{}:{path}", packages.display(), programs.display());
    let ended = run(Command::new("sh")
        .args(["-e", "-c", &example])
        .env("PATH", path));
    assert_eq!(ended.code, 0, "{ended:?}");
    let expected = "[21.5, 21.5, 21.5, 21.5, 21.5, 21.5, 21.5, 21.5]\n";
    assert_eq!(ended.stdout, expected, "{ended:?}");
}
