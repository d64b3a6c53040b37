//! What only FUSE can do or fail at: namespaces, a rebuilt `/dev`, users, the kernel's FUSE device. `both_ways.rs`
//! tests what every way must do, and says which variables to set without FUSE.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of tests are outside the functions that clippy knows as tests"
)]

#[expect(dead_code, reason = "each test program uses some of it")]
mod common;

use std::convert::Infallible;
use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

use common::{
    NotHere, RegisterFile, assert_nothing_left, fuse_works as fuse, processes_that_mount, skip,
    wait_until,
};
use embedded_hal::i2c::{ErrorType, I2c, Operation, SevenBitAddress};
use i2c_emulation::adapter::{BusFault, Fault, HalAdapter};
use i2c_emulation::fuse::{Options, run};
use i2c_emulation::ioctl::AdapterMode;
use i2c_emulation::program::RunError;

/// Tells a test's helper process its role; see [`role`].
const ROLE: &str = "I2C_EMULATION_TEST_ROLE";
const ROLE_DEVICE: &str = "I2C_EMULATION_TEST_DEVICE";
const ROLE_FUSE: &str = "I2C_EMULATION_TEST_FUSE";

type Adapter = HalAdapter<RegisterFile, fn(&NotHere) -> Fault>;

/// One emulated bus with a number that no other test on this machine uses.
struct Bench {
    number: u32,
    options: Options,
    adapter: Mutex<Adapter>,
}

impl Bench {
    fn new(mode: AdapterMode) -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = 1000 + std::process::id() % 9000 * 100 + NEXT.fetch_add(1, Ordering::Relaxed);
        let mut options = Options::new(format!("/dev/i2c-{number}"));
        options.mode = mode;
        Self {
            number,
            options,
            adapter: Mutex::new(HalAdapter::new(RegisterFile::new())),
        }
    }

    fn run(&self, command: &mut Command) -> Result<ExitStatus, RunError> {
        let outcome = run(&self.adapter, &self.options, command);
        assert_nothing_left(&self.options.device);
        outcome
    }

    /// Runs a program to its end. Output goes through a file, since `run` waits for the end.
    fn output(&self, program: &Path, arguments: &[&str]) -> String {
        let (status, output) = self.outcome(Command::new(program).args(arguments));
        assert!(
            status.success(),
            "{} {arguments:?}: {status}\n{output}",
            program.display()
        );
        output
    }

    fn outcome(&self, command: &mut Command) -> (ExitStatus, String) {
        let file = tempfile::NamedTempFile::new().unwrap();
        let status = self
            .run(
                command
                    .stdout(file.reopen().unwrap())
                    .stderr(file.reopen().unwrap()),
            )
            .unwrap();
        (status, fs::read_to_string(file.path()).unwrap())
    }
}

#[test]
fn only_the_program_sees_the_device_and_the_rest_of_dev_is_as_before() {
    if !fuse() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let device = bench.options.device.display().to_string();
    let script = format!(
        "test -e {device} && test -c /dev/null && test -d /dev/pts && echo text > /dev/null && ls /dev | grep -v i2c-{}",
        bench.number
    );
    let seen = bench.output(Path::new("sh"), &["-c", &script]);
    let mut outside: Vec<String> = fs::read_dir("/dev")
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    outside.sort_unstable();
    let mut seen: Vec<&str> = seen.lines().collect();
    seen.sort_unstable();
    assert_eq!(seen, outside);
}

#[test]
fn a_file_that_exists_is_covered_and_comes_back() {
    if !fuse() {
        return;
    }
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), "as before").unwrap();
    let bench = Bench::new(AdapterMode::Pi);
    let mut options = bench.options.clone();
    options.device = file.path().to_owned();
    let script = format!(
        "import os, fcntl\nf = os.open('{}', os.O_RDWR)\nfcntl.ioctl(f, 0x0703, 0x69)\nassert os.read(f, 1) == b'\\x03'",
        file.path().display()
    );
    let status = run(
        &bench.adapter,
        &options,
        Command::new("python3").args(["-c", &script]),
    )
    .unwrap();
    assert!(status.success());
    assert_eq!(fs::read_to_string(file.path()).unwrap(), "as before");
    assert!(processes_that_mount(file.path()).is_empty());
}

#[test]
fn each_failure_has_its_own_error() {
    if !fuse() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let fails = |device: &str, fuse_device: &str, program: &str| {
        let mut options = bench.options.clone();
        if !device.is_empty() {
            options.device = PathBuf::from(device);
        }
        if !fuse_device.is_empty() {
            options.fuse_device = PathBuf::from(fuse_device);
        }
        let error = run(&bench.adapter, &options, &mut Command::new(program)).unwrap_err();
        assert_nothing_left(&bench.options.device);
        let text = error.to_string();
        assert!(
            text.contains("\nhint: ") && !text.starts_with(char::is_uppercase),
            "{text}"
        );
        error
    };
    assert!(matches!(
        fails("", "/dev/no-fuse-here", "true"),
        RunError::NoFuse { .. }
    ));
    assert!(
        matches!(fails("", "/dev/null", "true"), RunError::Setup { step, .. } if step.contains("mounting fuse"))
    );
    assert!(
        matches!(fails("", "", "no-such-program"), RunError::ProgramNotFound(program) if program == "no-such-program")
    );
    assert!(matches!(
        fails("", "", "/dev/null"),
        RunError::ProgramNotStarted { .. }
    ));
    assert!(matches!(
        fails("/dev", "", "true"),
        RunError::DeviceIsFolder { .. }
    ));
    assert!(matches!(
        fails("/tmp/no-such-device", "", "true"),
        RunError::DeviceMissing { .. }
    ));
    assert!(matches!(
        fails("/dev/zero\0byte", "", "true"),
        RunError::PathWithZero { .. }
    ));
}

/// The server may be root while the program is not.
#[test]
fn a_program_that_runs_as_another_user_may_use_the_device() {
    const NOBODY: u32 = 65534;
    if !fuse() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let script = format!(
        "import os, fcntl\nf = os.open('{}', os.O_RDWR)\nfcntl.ioctl(f, 0x0703, 0x69)\nprint(os.getuid(), os.read(f, 1).hex())",
        bench.options.device.display()
    );
    let mut command = Command::new("python3");
    command.args(["-c", &script]).uid(NOBODY).gid(NOBODY);
    match bench.run(command.stdout(Stdio::null())) {
        Ok(status) => assert!(status.success(), "{status}"),
        Err(RunError::ProgramNotStarted(_, source)) if source.raw_os_error() == Some(1) => {
            skip::test("a program of another user: only root can start one");
        }
        Err(error) => panic!("{error}"),
    }
}

/// The emulator's process is killed: the program finds a dead bus, as if it had been unplugged, and nothing remains.
/// The call in progress ends with ECONNABORTED (103), every later one with ENOTCONN (107).
#[test]
fn a_killed_server_leaves_a_dead_bus_and_then_nothing() {
    if !fuse() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let mut server = role("serve", &bench.options)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(server.stdout.take().unwrap()).lines();
    let mut next = || {
        lines
            .by_ref()
            .map(Result::unwrap)
            .find(|line| line.starts_with("program:"))
    };
    assert_eq!(next().as_deref(), Some("program: reading"));
    assert!(
        !processes_that_mount(&bench.options.device).is_empty(),
        "the check for leftovers sees the mount"
    );
    server.kill().unwrap();
    server.wait().unwrap();
    assert_eq!(next().as_deref(), Some("program: errno 107"));
    assert_eq!(next(), None, "the program has ended");
    wait_until(|| processes_that_mount(&bench.options.device).is_empty());
    assert_nothing_left(&bench.options.device);
}

/// Without root: user namespaces, and a /dev/fuse that everyone may open.
#[test]
fn without_root_a_user_namespace_does_it() {
    const NOBODY: u32 = 65534;
    if !fuse() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let node = folder.path().join("fuse");
    let made = Command::new("mknod")
        .args(["-m", "666"])
        .arg(&node)
        .args(["c", "10", "229"])
        .output()
        .unwrap();
    if !made.status.success() {
        skip::test("running as another user: only root can make the device file for it");
        return;
    }
    Command::new("chmod")
        .arg("755")
        .arg(folder.path())
        .status()
        .unwrap();
    let mut bench = Bench::new(AdapterMode::Pi);
    bench.options.fuse_device = node;
    let output = role("read once", &bench.options)
        .uid(NOBODY)
        .gid(NOBODY)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        said.contains("program: user 65534 read 73 exit 5"),
        "{said}\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert_nothing_left(&bench.options.device);

    for (wrong, error) in [
        ("no program", "program not found: /no/such/program"),
        ("no folder", "program not found: true"),
    ] {
        let output = role(wrong, &bench.options)
            .uid(NOBODY)
            .gid(NOBODY)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(said.contains(error), "{wrong}: {said}");
    }

    bench.options.fuse_device = PathBuf::from("/dev/fuse");
    let output = role("read once", &bench.options)
        .uid(NOBODY)
        .gid(NOBODY)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    if !said.contains("program: user") {
        assert!(said.contains("not permitted: opening /dev/fuse"), "{said}");
        assert!(said.contains("hint: run as root"), "{said}");
    }
}

/// This test program again, as a helper process that acts as `role` says.
fn role(role: &str, options: &Options) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args([
            "--exact",
            "helper_process",
            "--nocapture",
            "--test-threads=1",
        ])
        .env(ROLE, role)
        .env(ROLE_DEVICE, &options.device)
        .env(ROLE_FUSE, &options.fuse_device);
    command
}

/// Not a test itself: [`role`] starts it.
#[test]
fn helper_process() {
    let Ok(role) = std::env::var(ROLE) else {
        return;
    };
    let mut options = Options::new(std::env::var(ROLE_DEVICE).unwrap());
    options.fuse_device = PathBuf::from(std::env::var(ROLE_FUSE).unwrap());
    let adapter = Mutex::new(HalAdapter::new(RegisterFile::new()));
    let script = match role.as_str() {
        "serve" => {
            "fcntl.ioctl(f, 0x0703, 0x69)\nos.read(f, 1)\nprint('\\nprogram: reading', flush=True)\n\
             while True:\n\
             \x20   try: os.read(f, 1)\n\
             \x20   except OSError as error:\n\
             \x20       if error.errno == 103: continue\n\
             \x20       print('program: errno', error.errno, flush=True)\n\
             \x20       break"
        }
        _ => {
            "fcntl.ioctl(f, 0x0703, 0x69)\nos.write(f, b'\\x10')\n\
             print('\\nprogram: user', os.getuid(), 'read', os.read(f, 1).hex(), end=' ', flush=True)\nos._exit(5)"
        }
    };
    let script = format!(
        "import os, fcntl\nf = os.open('{}', os.O_RDWR)\n{script}",
        options.device.display()
    );
    let mut command = match role.as_str() {
        "no program" => Command::new("/no/such/program"),
        "no folder" => Command::new("true"),
        _ => Command::new("python3"),
    };
    command.args(["-c", &script]);
    if role == "no folder" {
        command.current_dir("/no-such-folder");
    }
    match run(&adapter, &options, &mut command) {
        Ok(status) => println!("exit {}", status.code().unwrap()),
        Err(error) => println!("{error}"),
    }
}

#[test]
fn a_bus_that_cannot_fail_needs_no_error_type_of_its_own() {
    struct Silent;
    impl ErrorType for Silent {
        type Error = Infallible;
    }
    impl I2c for Silent {
        fn transaction(
            &mut self,
            _: SevenBitAddress,
            _: &mut [Operation<'_>],
        ) -> Result<(), Infallible> {
            Ok(())
        }
    }
    let _ = HalAdapter::with_faults(Silent, |never| match *never {});
    assert_eq!(Fault::Timeout.fault(), Fault::Timeout);
}
