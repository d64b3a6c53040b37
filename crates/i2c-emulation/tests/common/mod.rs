//! A chip, and helpers for the tests of programs at `/dev/i2c-N`.

#[expect(unreachable_pub, reason = "the tests of the whole share this file")]
#[path = "../../../../tests/src/patience.rs"]
mod patience;
#[expect(
    dead_code,
    unreachable_pub,
    reason = "the tests of the whole share this file"
)]
#[path = "../../../../tests/src/skip.rs"]
pub(crate) mod skip;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

use embedded_hal::i2c::{
    ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation, SevenBitAddress,
};
use i2c_emulation::adapter::HalAdapter;
use i2c_emulation::ioctl::AdapterMode;
use i2c_emulation::program::{self, Ended, Options, RunError};
use i2c_emulation::rack::{Rack, SharedAdapter};

pub(crate) const TARGET: u8 = 0x69;

/// 256 registers with an address pointer that advances by itself; register n starts as n times 7 plus 3.
#[derive(Clone)]
pub(crate) struct RegisterFile(Arc<Mutex<Registers>>);

pub(crate) struct Registers {
    pub(crate) values: [u8; 256],
    pointer: u8,
}

impl RegisterFile {
    pub(crate) fn new() -> Self {
        Self(Arc::new(Mutex::new(Registers {
            values: std::array::from_fn(first_value),
            pointer: 0,
        })))
    }

    pub(crate) fn values(&self) -> [u8; 256] {
        self.0.lock().unwrap().values
    }
}

pub(crate) fn first_value(register: usize) -> u8 {
    (register * 7 + 3).to_le_bytes()[0]
}

#[derive(Debug)]
pub(crate) struct NotHere;

impl embedded_hal::i2c::Error for NotHere {
    fn kind(&self) -> ErrorKind {
        ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)
    }
}

impl ErrorType for RegisterFile {
    type Error = NotHere;
}

impl I2c for RegisterFile {
    fn transaction(
        &mut self,
        address: SevenBitAddress,
        operations: &mut [Operation<'_>],
    ) -> Result<(), NotHere> {
        if address != TARGET {
            return Err(NotHere);
        }
        let mut chip = self.0.lock().unwrap();
        for operation in operations {
            match operation {
                Operation::Write([]) => {}
                Operation::Write([pointer, bytes @ ..]) => {
                    chip.pointer = *pointer;
                    for byte in bytes.iter() {
                        let at = usize::from(chip.pointer);
                        chip.values[at] = *byte;
                        chip.pointer = chip.pointer.wrapping_add(1);
                    }
                }
                Operation::Read(buffer) => {
                    for byte in buffer.iter_mut() {
                        *byte = chip.values[usize::from(chip.pointer)];
                        chip.pointer = chip.pointer.wrapping_add(1);
                    }
                }
            }
        }
        Ok(())
    }
}

/// One emulated bus with a number that no other test on this machine uses.
pub(crate) struct Bench {
    pub(crate) number: u32,
    pub(crate) options: Options,
    pub(crate) chip: RegisterFile,
    pub(crate) rack: Rack,
}

impl Bench {
    pub(crate) fn new(mode: AdapterMode) -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = 1000 + std::process::id() % 9000 * 100 + NEXT.fetch_add(1, Ordering::Relaxed);
        let chip = RegisterFile::new();
        let mut rack = Rack::new();
        rack.insert(number, SharedAdapter::new(HalAdapter::new(chip.clone())));
        Self {
            number,
            options: Options {
                mode,
                ..Options::default()
            },
            chip,
            rack,
        }
    }

    pub(crate) fn device(&self) -> PathBuf {
        PathBuf::from(format!("/dev/i2c-{}", self.number))
    }

    pub(crate) fn run(&self, command: &mut Command) -> Result<Ended, RunError> {
        let outcome = program::run(&self.rack, &self.options, command);
        assert_nothing_left(&self.device());
        outcome
    }

    /// Runs a program to its end. Output goes through a file, since `run` waits for the end.
    pub(crate) fn output(&self, program: &Path, arguments: &[&str]) -> String {
        let (status, output) = self.outcome(Command::new(program).args(arguments));
        assert!(
            status.success(),
            "{} {arguments:?}: {status}\n{output}",
            program.display()
        );
        output
    }

    pub(crate) fn outcome(&self, command: &mut Command) -> (ExitStatus, String) {
        let file = tempfile::NamedTempFile::new().unwrap();
        let ended = self
            .run(
                command
                    .stdout(file.reopen().unwrap())
                    .stderr(file.reopen().unwrap()),
            )
            .unwrap();
        (ended.status, fs::read_to_string(file.path()).unwrap())
    }

    /// Runs Python, which has the path as `DEVICE`, the open file as `f`, and `rdwr(messages)`.
    pub(crate) fn python(&self, script: &str) -> String {
        let script = self.script(script);
        self.output(Path::new("python3"), &["-c", &script])
    }

    pub(crate) fn script(&self, script: &str) -> String {
        let prelude = include_str!("../i2c.py");
        format!(
            "{prelude}\nDEVICE = '/dev/i2c-{}'\nf = os.open(DEVICE, os.O_RDWR)\n{script}",
            self.number
        )
    }

    pub(crate) fn i2c_tool(&self, name: &str, arguments: &str) -> Option<String> {
        let arguments = arguments.replace("BUS", &self.number.to_string());
        let arguments: Vec<&str> = arguments.split(' ').collect();
        Some(self.output(&i2c_tools()?.join(name), &arguments))
    }
}

pub(crate) fn assert_nothing_left(device: &Path) {
    assert!(!device.exists(), "{} was left behind", device.display());
}

/// Waits for processes to end.
pub(crate) fn wait_until(mut done: impl FnMut() -> bool) {
    patience::wait_for("the end", || done().then_some(()));
}

/// Every process's folder in /proc.
pub(crate) fn processes() -> impl Iterator<Item = PathBuf> {
    fs::read_dir("/proc")
        .unwrap()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.join("stat").exists())
}

pub(crate) fn excused(variable: &str) -> bool {
    std::env::var_os(variable).is_some_and(|value| value == "1")
}

/// The folder of i2c-tools.
pub(crate) fn i2c_tools() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&path)
        .chain(["/usr/sbin", "/sbin"].map(PathBuf::from))
        .find(|folder| folder.join("i2cdetect").exists());
    if found.is_none() {
        assert!(
            excused("GRIDEYE_WITHOUT_I2C_TOOLS"),
            "i2c-tools is missing: apt-get install i2c-tools, or set GRIDEYE_WITHOUT_I2C_TOOLS=1 to leave this test out"
        );
        skip::test("i2c-tools are missing");
    }
    found
}

/// Whether Python is available; the variable for i2c-tools also excuses its absence.
pub(crate) fn python_works() -> bool {
    let found = Command::new("python3").arg("--version").output().is_ok();
    if !found {
        assert!(
            excused("GRIDEYE_WITHOUT_I2C_TOOLS"),
            "python3 is missing: apt-get install python3, or set GRIDEYE_WITHOUT_I2C_TOOLS=1 to leave this test out"
        );
        skip::test("python3 is missing");
    }
    found
}
