//! Runs the worked example `tests/examples/driver-ci` like a public CI: the `run:` lines of its workflow file, in a
//! copy of its folder with this repository beside it. Whatever those lines would download or build is already here.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

use grideye_tests::programs::{Ended, folder, root, run, target};
use grideye_tests::python;
use grideye_tests::workflow::{self, run_lines};
use serde_json::Value;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

const EXAMPLE: &str = "tests/examples/driver-ci";
const WORKFLOW: &str = "tests/examples/driver-ci/.github/workflows/driver.yml";
const ACTION: &str = "tests/examples/driver-ci/.github/actions/emulated-sensor/action.yml";

/// Lines that begin like this are not run: this build has the programs, and a local environment the same package
/// versions.
const FETCHES: [&str; 4] = [
    "rustup toolchain install ",
    "cargo build --release --manifest-path grideye-hil/Cargo.toml ",
    "pip install ",
    "echo \"$PWD/grideye-hil/target/release\" >> ",
];

/// The lines that run a suite: Python's, Rust's in-process tests, and Rust's program.
fn suites() -> [String; 3] {
    let mut lines = run_lines(WORKFLOW);
    lines.retain(|line| !FETCHES.iter().any(|fetch| line.starts_with(fetch)));
    lines.try_into().unwrap()
}

/// The example's folder as its own project, checked out with this repository beside it.
struct Checkout {
    folder: PathBuf,
    path: OsString,
}

impl Checkout {
    /// One per test, at a fixed path: cargo identifies packages by it.
    fn new(name: &str) -> Self {
        let folder = target().join("driver-ci").join(name);
        // The folder does not exist the first time.
        let _ = std::fs::remove_dir_all(&folder);
        copy(&root().join(EXAMPLE), &folder);
        std::os::unix::fs::symlink(root().canonicalize().unwrap(), folder.join("grideye-hil"))
            .unwrap();
        Self {
            folder,
            path: with_path(self::folder()),
        }
    }

    /// As [`new`](Self::new), with the Python packages of the workflow, if they are not left out here.
    fn with_python(name: &str) -> Option<Self> {
        let programs = installed()?;
        let mut checkout = Self::new(name);
        let mut path = with_path(programs);
        path.push(":");
        path.push(&checkout.path);
        checkout.path = path;
        Some(checkout)
    }

    /// Runs a line like GitHub's machines do if a step names no shell.
    fn run(&self, line: &str) -> Ended {
        let ended = run(Command::new("bash")
            .args(["-e", "-c", line])
            .current_dir(&self.folder)
            .env("PATH", &self.path)
            .env("CARGO_TARGET_DIR", target().join("driver-ci/build")));
        println!("$ {line}\n{}\n{}", ended.stdout, ended.stderr);
        ended
    }

    fn replace(&self, file: &str, from: &str, to: &str) {
        let path = self.folder.join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{file} has no {from}");
        std::fs::write(path, text.replace(from, to)).unwrap();
    }

    /// Moves the person to the other side of the sensor; the room's temperature stays.
    fn move_the_person(&self) {
        self.replace("room.toml", "[2500, 1850, 0]", "[1500, 1850, 0]");
    }

    /// Makes the Python driver read pixel 2 as pixel 1, in a copy that Python finds before the installed one.
    fn break_the_python_driver(&self) {
        let look = "import grideye, os; print(os.path.dirname(grideye.__file__))";
        let found = run(Command::new(installed().unwrap().join("python"))
            .args(["-c", look])
            .current_dir("/"));
        copy(
            Path::new(found.stdout.trim()),
            &self.folder.join("python/grideye"),
        );
        let file = "python/grideye/grideye.py";
        self.replace(file, "0x80 + line * 16", "0x82 + line * 16");
    }

    /// The same for the Rust driver, by cargo's way to replace a crate.
    fn break_the_rust_driver(&self) {
        let metadata = run(Command::new(env!("CARGO"))
            .args(["metadata", "--format-version", "1"])
            .args(["--manifest-path", "rust/Cargo.toml"])
            .current_dir(&self.folder));
        let metadata: Value = serde_json::from_str(&metadata.stdout).unwrap();
        let mut packages = metadata["packages"].as_array().unwrap().iter();
        let driver = packages
            .find(|package| package["name"] == "grideye")
            .unwrap();
        let manifest = Path::new(driver["manifest_path"].as_str().unwrap());
        let broken = self.folder.join("broken-driver");
        copy(manifest.parent().unwrap(), &broken);
        let register = "TemperatureStart = 0x80";
        self.replace(
            "broken-driver/src/lib.rs",
            register,
            "TemperatureStart = 0x82",
        );
        std::fs::create_dir(self.folder.join(".cargo")).unwrap();
        let patch = format!("[patch.crates-io]\ngrideye = {{ path = {broken:?} }}\n");
        std::fs::write(self.folder.join(".cargo/config.toml"), patch).unwrap();
    }
}

/// The programs of an environment with what the workflow installs: the wheel of this build, and the packages that the
/// tests of the Python package have in the same versions.
fn installed() -> Option<&'static Path> {
    static PROGRAMS: OnceLock<Option<PathBuf>> = OnceLock::new();
    let install = || {
        let at = target().join("driver-ci/python-package");
        // The folder does not exist the first time.
        let _ = std::fs::remove_dir_all(&at);
        let (_, bin) = python::wheel(&at, "the Python suite of the example for CI")?;
        let asked = read(&format!("{EXAMPLE}/python/requirements.txt"));
        let there = read(python::BESIDE_THE_WHEEL);
        let pins = asked.lines().filter(|line| line.contains("=="));
        for pin in pins {
            assert!(there.lines().any(|line| line == pin), "{pin}");
        }
        Some(bin)
    };
    PROGRAMS.get_or_init(install).as_deref()
}

fn read(file: &str) -> String {
    std::fs::read_to_string(root().join(file)).unwrap()
}

/// `PATH` with this folder first.
fn with_path(first: &Path) -> OsString {
    let mut path = first.as_os_str().to_owned();
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap());
    path
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let place = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &place);
        } else {
            std::fs::copy(entry.path(), place).unwrap();
        }
    }
}

/// How many transactions the suite made, from the emulator's last line.
fn transactions(ended: &Ended) -> u32 {
    assert!(
        ended
            .stderr
            .contains(": ceiling at 1:0x69, showing room.toml"),
        "{ended:?}"
    );
    let counted = ended
        .stderr
        .lines()
        .find_map(|line| line.split_once(" transactions, "));
    counted.unwrap().0.parse().unwrap()
}

/// Whether this test passed, from Rust's or Python's report.
fn passed(ended: &Ended, test: &str) -> bool {
    let line = ended
        .stdout
        .lines()
        .find(|line| line.contains(&format!("{test} ")) && !line.starts_with("FAILED"));
    let line = line.unwrap_or_else(|| panic!("{test} did not run: {ended:?}"));
    line.contains("PASSED") || line.ends_with("... ok")
}

/// By GitHub's own schema, and its lines by a YAML parser.
#[test]
fn a_public_ci_takes_the_workflow() {
    let requirements = "tests/examples/requirements.txt";
    let what = "the example's workflow against GitHub's schema";
    let Some(programs) = python::programs("examples", requirements, what) else {
        return;
    };
    workflow::check(&programs, "vendor.github-workflows", WORKFLOW);
    workflow::check(&programs, "vendor.github-actions", ACTION);

    let read = "import json, sys; from ruamel.yaml import YAML; \
                workflow = YAML(typ='safe').load(open(sys.argv[1])); \
                print(json.dumps([step['run'] for job in workflow['jobs'].values() for step in job['steps'] if 'run' in step]))";
    let read = run(Command::new(programs.join("python"))
        .args(["-c", read])
        .arg(root().join(WORKFLOW)));
    let lines: Vec<String> = serde_json::from_str(&read.stdout).unwrap();
    assert_eq!(lines, run_lines(WORKFLOW));
    let is_there = |fetch: &&str| lines.iter().any(|line| line.starts_with(*fetch));
    assert!(FETCHES.iter().all(is_there), "{lines:?}");
}

#[test]
fn the_python_suite_passes_on_the_emulated_sensor() {
    let Some(checkout) = Checkout::with_python("python") else {
        return;
    };
    let [line, ..] = suites();
    let ended = checkout.run(&line);
    assert_eq!(ended.code, 0, "{ended:?}");
    assert!(ended.stdout.contains("6 passed"), "{ended:?}");
}

/// The action's second step, with its inputs as GitHub sets them; the first one fetches.
#[test]
fn the_action_runs_the_suite_and_any_program_on_the_emulated_device() {
    let Some(checkout) = Checkout::with_python("action") else {
        return;
    };
    let lines = run_lines(ACTION);
    let [fetch, line] = lines.as_slice() else {
        panic!("{lines:?}");
    };
    assert!(fetch.starts_with("pip install "), "{fetch}");
    let ran = |scene: &str, command: &str| {
        let given = format!("export SCENE='{scene}' COMMAND='{command}'; {line}");
        checkout.run(&given)
    };
    let ended = ran("", "pytest -v python");
    assert_eq!(ended.code, 0, "{ended:?}");
    assert!(ended.stdout.contains("6 passed"), "{ended:?}");
    let program = r#"python -c "import smbus2; print(smbus2.SMBus(1).read_byte_data(0x69, 0))""#;
    let ended = ran("room.toml", program);
    assert_eq!(
        (ended.code, ended.stdout.as_str()),
        (
            0, "0
"
        ),
        "{ended:?}"
    );
    assert_eq!(transactions(&ended), 1, "{ended:?}");
    assert_eq!(ran("room.toml", "exit 7").code, 7);
}

#[test]
fn the_python_suite_sees_the_room_that_it_is_shown() {
    let Some(checkout) = Checkout::with_python("python-moved") else {
        return;
    };
    checkout.move_the_person();
    let [line, ..] = suites();
    let ended = checkout.run(&line);
    assert_eq!(ended.code, 1, "{ended:?}");
    assert!(passed(&ended, "test_the_room_has_its_temperature"));
    assert!(!passed(
        &ended,
        "test_the_person_is_where_the_scene_has_them"
    ));
}

#[test]
fn a_wrong_register_fails_the_python_suite() {
    let Some(checkout) = Checkout::with_python("python-broken") else {
        return;
    };
    checkout.break_the_python_driver();
    let [line, ..] = suites();
    let ended = checkout.run(&line);
    assert_eq!(ended.code, 1, "{ended:?}");
    assert!(passed(
        &ended,
        "test_the_chip_is_a_little_warmer_than_the_room"
    ));
    assert!(passed(&ended, "test_the_interrupt_marks_the_person"));
    assert!(!passed(
        &ended,
        "test_the_person_is_where_the_scene_has_them"
    ));
}

const IN_PROCESS: &str = "the_person_is_where_the_scene_has_them";
const PROGRAM: &str = "the_program_says_where_the_person_is";

/// One test after another, since cargo builds only once per checkout.
#[test]
fn the_rust_suites_pass_and_see_the_room_that_they_are_shown() {
    let checkout = Checkout::new("rust");
    let [_, in_process, program] = suites();
    let ended = checkout.run(&in_process);
    assert_eq!(ended.code, 0, "{ended:?}");
    assert!(passed(&ended, IN_PROCESS));
    let ended = checkout.run(&program);
    assert_eq!(ended.code, 0, "{ended:?}");
    assert!(passed(&ended, PROGRAM));
    // The image, pixel by pixel.
    assert!(transactions(&ended) >= 64, "{ended:?}");

    checkout.move_the_person();
    let ended = checkout.run(&in_process);
    assert!(ended.code != 0 && !passed(&ended, IN_PROCESS));
    assert!(passed(&ended, "nobody_is_in_an_empty_room"));
    let ended = checkout.run(&program);
    assert!(ended.code != 0 && !passed(&ended, PROGRAM));
}

#[test]
fn a_wrong_register_fails_the_rust_suites() {
    let checkout = Checkout::new("rust-broken");
    checkout.break_the_rust_driver();
    let [_, in_process, program] = suites();
    let ended = checkout.run(&in_process);
    assert!(ended.code != 0 && !passed(&ended, IN_PROCESS));
    assert!(passed(&ended, "a_sensor_at_the_other_address_is_an_error"));
    let ended = checkout.run(&program);
    assert!(ended.code != 0 && !passed(&ended, PROGRAM));
    assert!(transactions(&ended) >= 64, "{ended:?}");
}
