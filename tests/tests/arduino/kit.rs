//! What compiles a sketch for this host, and runs it on an emulated bus.

use grideye_tests::c_library::library;
use grideye_tests::programs::{self, Ended, is_left_out, root, run};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

pub(crate) const WITHOUT_CXX: &str = "GRIDEYE_WITHOUT_CXX";
pub(crate) const WITHOUT_AVR: &str = "GRIDEYE_WITHOUT_AVR";
const CORE: &str = "crates/i2c-emulation/arduino";
const WIRE: &str = "crates/amg8833-c/arduino";
pub(crate) const EXAMPLE: &str = "tests/examples/firmware-ci";

fn compile(flags: &[&str], out: &Path, sources: &[&Path]) {
    let core = root().join(CORE);
    let driver = root().join(EXAMPLE).join("lib/grid_eye");
    let [header, wire] = ["crates/amg8833-c/include", WIRE].map(|folder| root().join(folder));
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
            Path::new("-I"),
            &header,
            Path::new("-I"),
            &wire,
            Path::new("-o"),
            out,
        ])
        .args(sources)
        .args(["-lm", "-lpthread", "-ldl"]));
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

/// A sketch or a test with the core and the example's driver, as the head of `Arduino.h` says, for a bus at `/dev/i2c-N`;
/// `None` if the compiler is left out.
pub(crate) fn compiled(folder: &Path, source: &str, what: &str) -> Option<PathBuf> {
    built(folder, source, &[], what)
}

/// The same with its sensors in the program.
pub(crate) fn compiled_with_sensors(folder: &Path, source: &str, what: &str) -> Option<PathBuf> {
    let wire = root().join(WIRE).join("amg8833_wire.cpp");
    let more = [root().join(MACHINE), wire, library()];
    built(folder, source, &more.each_ref().map(PathBuf::as_path), what)
}

fn built(folder: &Path, source: &str, more: &[&Path], what: &str) -> Option<PathBuf> {
    if is_left_out(WITHOUT_CXX, what) {
        return None;
    }
    let out = folder.join("sketch");
    let source = root().join(source);
    let driver = root().join(EXAMPLE).join("lib/grid_eye/grid_eye.cpp");
    let [x, cpp, none] = ["-x", "c++", "none"].map(Path::new);
    let core = core();
    let sources = [&[x, cpp, &source, x, none, &driver, &core], more].concat();
    compile(&["-include", "Arduino.h"], &out, &sources);
    Some(out)
}

/// Where the sensors of a sketch are said: `machine.cpp`.
pub(crate) const MACHINE: &str = "tests/arduino/machine.cpp";

/// A program with its sensors in itself: what they see, and where its transactions are written down.
pub(crate) fn on_the_bus(machine: &str, trace: &Path, program: &Path) -> Command {
    let mut command = Command::new(program);
    command.env("MACHINE", machine).env("TRACE", trace);
    command
}

pub(crate) fn path(path: &Path) -> &str {
    path.to_str().unwrap()
}

pub(crate) fn read(file: &str) -> String {
    std::fs::read_to_string(root().join(file)).unwrap()
}

/// A transaction of `machine.cpp`: when it began, and the bytes of each of its messages.
pub(crate) struct Transaction {
    pub(crate) start_s: f64,
    pub(crate) lengths: Vec<usize>,
}

pub(crate) fn transactions(trace: &Path) -> Vec<Transaction> {
    let mut transactions: Vec<Transaction> = Vec::new();
    for row in std::fs::read_to_string(trace).unwrap().lines() {
        let (start_s, messages) = row.split_once(' ').unwrap();
        let length = |message: &str| match message.split_at(1) {
            ("r", count) => count.parse().unwrap(),
            (_, bytes) => bytes.len() / 2,
        };
        transactions.push(Transaction {
            start_s: start_s.parse().unwrap(),
            lengths: messages.split(' ').map(length).collect(),
        });
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
