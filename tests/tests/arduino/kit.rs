//! What compiles a sketch for this host, and runs it on an emulated bus.

use grideye_tests::c_library::library;
use grideye_tests::programs::{self, Ended, grideye, is_left_out, root, run};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

pub(crate) const WITHOUT_CXX: &str = "GRIDEYE_WITHOUT_CXX";
pub(crate) const WITHOUT_AVR: &str = "GRIDEYE_WITHOUT_AVR";
const CORE: &str = "crates/i2c-emulation/arduino";
pub(crate) const EXAMPLE: &str = "tests/examples/firmware-ci";

fn compile(flags: &[&str], out: &Path, sources: &[&Path]) {
    let core = root().join(CORE);
    let driver = root().join(EXAMPLE).join("lib/grid_eye");
    let ended = run(Command::new("g++")
        .args([
            "-std=c++11",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-DARDUINO=10819",
        ])
        .args(flags)
        .args([
            Path::new("-I"),
            &core,
            Path::new("-I"),
            &driver,
            Path::new("-o"),
            out,
        ])
        .args(sources));
    assert_eq!(ended.code, 0, "{sources:?}: {ended:?}");
}

/// The core, compiled once for all.
fn core() -> PathBuf {
    static CORE_OBJECT: OnceLock<tempfile::TempDir> = OnceLock::new();
    let made = CORE_OBJECT.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let source = root().join(CORE).join("arduino.cpp");
        // Optimized, since g++ then sees more that is wrong.
        compile(&["-c", "-O2"], &folder.path().join("core.o"), &[&source]);
        folder
    });
    made.path().join("core.o")
}

/// A sketch or a test with the core and the example's driver, as the head of `Arduino.h` says; `None` if the compiler is
/// left out.
pub(crate) fn compiled(folder: &Path, source: &str, what: &str) -> Option<PathBuf> {
    if is_left_out(WITHOUT_CXX, what) {
        return None;
    }
    let out = folder.join("sketch");
    let source = root().join(source);
    let driver = root().join(EXAMPLE).join("lib/grid_eye/grid_eye.cpp");
    let as_cpp = [
        Path::new("-x"),
        Path::new("c++"),
        &source,
        Path::new("-x"),
        Path::new("none"),
    ];
    let core = core();
    let sources = [&as_cpp[..], &[&driver, &core]].concat();
    compile(&["-include", "Arduino.h"], &out, &sources);
    Some(out)
}

/// On an emulated bus as a microcontroller has it: without an adapter between.
pub(crate) fn on_the_bus(source: &[&str], program: &Path, arguments: &[&str]) -> Ended {
    let folder = tempfile::tempdir().unwrap();
    let mut command = grideye();
    command.args(["emulate", "--quiet", "--socket"]);
    command.arg(folder.path().join("bus")).args(source);
    run(command.arg("--").arg(program).args(arguments))
}

pub(crate) fn path(path: &Path) -> &str {
    path.to_str().unwrap()
}

pub(crate) fn read(file: &str) -> String {
    std::fs::read_to_string(root().join(file)).unwrap()
}

/// A transaction in a trace: when it began, and the bytes of each of its messages.
pub(crate) struct Transaction {
    pub(crate) start_s: f64,
    pub(crate) lengths: Vec<usize>,
}

pub(crate) fn transactions(trace: &Path) -> Vec<Transaction> {
    let mut transactions: Vec<Transaction> = Vec::new();
    for row in std::fs::read_to_string(trace).unwrap().lines().skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let length = cells[6].split_whitespace().count();
        match (cells[3], transactions.last_mut()) {
            ("Sr", Some(transaction)) => transaction.lengths.push(length),
            _ => transactions.push(Transaction {
                start_s: cells[0].parse().unwrap(),
                lengths: vec![length],
            }),
        }
    }
    transactions
}

/// The example's folder as the page has it made, and a line of the page or the workflow run in there.
pub(crate) struct Checkout(tempfile::TempDir);

impl Checkout {
    pub(crate) fn new() -> Self {
        let checkout = Self(tempfile::tempdir().unwrap());
        let page = read(&format!("{EXAMPLE}/README.md"));
        let copy = page
            .lines()
            .find(|line| line.starts_with("cp -r "))
            .unwrap();
        let ended = checkout.run(copy, &root());
        assert_eq!(ended.code, 0, "{ended:?}");
        checkout
    }

    pub(crate) fn folder(&self) -> PathBuf {
        self.0.path().join("firmware")
    }

    pub(crate) fn run(&self, line: &str, here: &Path) -> Ended {
        let line = line.replace("/tmp/firmware", path(&self.folder()));
        let mut search = programs::folder().canonicalize().unwrap().into_os_string();
        search.push(":");
        search.push(std::env::var_os("PATH").unwrap());
        let mut shell = Command::new("bash");
        run(shell
            .args(["-e", "-c", &line])
            .current_dir(here)
            .env("AMG8833", library())
            .env("PATH", search))
    }

    /// A line of the page that begins like this.
    pub(crate) fn run_page(&self, start: &str) -> Ended {
        let page = read(&format!("{EXAMPLE}/README.md"));
        let line = page.lines().find(|line| line.starts_with(start)).unwrap();
        self.run(line, &root())
    }
}
