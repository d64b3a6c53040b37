//! Programs that nobody here wrote, unmodified, with an emulated bus as their `/dev/i2c-N`.
//!
//! What a machine lacks must be named: `GRIDEYE_WITHOUT_FUSE=1` leaves out everything that needs FUSE,
//! `GRIDEYE_WITHOUT_I2C_TOOLS=1` what needs i2c-tools. Without these variables a lack fails the test.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of tests are outside the functions that clippy knows as tests"
)]

use std::convert::Infallible;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use embedded_hal::i2c::{
    ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation, SevenBitAddress,
};
use i2c_emulation::adapter::{BusFault, Fault, HalAdapter};
use i2c_emulation::fuse::{Options, RunError, probe, run};
use i2c_emulation::ioctl::AdapterMode;

const TARGET: u8 = 0x69;
/// Where a test's helper process learns its role; see [`role`].
const ROLE: &str = "I2C_EMULATION_TEST_ROLE";
const ROLE_DEVICE: &str = "I2C_EMULATION_TEST_DEVICE";
const ROLE_FUSE: &str = "I2C_EMULATION_TEST_FUSE";

/// 256 registers with an address pointer that moves on by itself; register n holds n times 7 plus 3 at first.
struct RegisterFile {
    registers: [u8; 256],
    pointer: u8,
}

impl RegisterFile {
    fn new() -> Self {
        Self {
            registers: std::array::from_fn(first_value),
            pointer: 0,
        }
    }
}

fn first_value(register: usize) -> u8 {
    (register * 7 + 3).to_le_bytes()[0]
}

#[derive(Debug)]
struct NotHere;

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
        for operation in operations {
            match operation {
                Operation::Write([]) => {}
                Operation::Write([pointer, bytes @ ..]) => {
                    self.pointer = *pointer;
                    for byte in bytes.iter() {
                        self.registers[usize::from(self.pointer)] = *byte;
                        self.pointer = self.pointer.wrapping_add(1);
                    }
                }
                Operation::Read(buffer) => {
                    for byte in buffer.iter_mut() {
                        *byte = self.registers[usize::from(self.pointer)];
                        self.pointer = self.pointer.wrapping_add(1);
                    }
                }
            }
        }
        Ok(())
    }
}

type Adapter = HalAdapter<RegisterFile, fn(&NotHere) -> Fault>;

/// One emulated bus under a number that no other test on this machine uses.
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

    /// Runs a program to its end; its output must be read from a file, since `run` waits for the end.
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

    /// Python sees the open file as `f`, and can call `rdwr(messages)` and `smbus(...)`.
    fn python(&self, script: &str) -> String {
        let prelude = include_str!("i2c.py");
        let script = format!(
            "{prelude}\nf = os.open('/dev/i2c-{}', os.O_RDWR)\n{script}",
            self.number
        );
        self.output(Path::new("python3"), &["-c", &script])
    }

    fn i2c_tool(&self, name: &str, arguments: &str) -> Option<String> {
        let arguments = arguments.replace("BUS", &self.number.to_string());
        let arguments: Vec<&str> = arguments.split(' ').collect();
        Some(self.output(&i2c_tools()?.join(name), &arguments))
    }
}

/// No mount of any process, no file and no child names the device any more.
fn assert_nothing_left(device: &Path) {
    assert!(!device.exists(), "{} was left behind", device.display());
    let left = processes_that_mount(device);
    assert!(left.is_empty(), "still mounted for processes {left:?}");
    let own = fs::read_to_string("/proc/thread-self/mountinfo").unwrap();
    assert!(
        !own.contains("i2c-emulation"),
        "the caller's own namespace was changed:\n{own}"
    );
}

/// Gives processes that have lost their bus the time to end.
fn wait_until_gone(device: &Path) {
    let deadline = Instant::now() + Duration::from_secs(10);
    while !processes_that_mount(device).is_empty() && Instant::now() < deadline {
        std::thread::yield_now();
    }
}

fn processes_that_mount(device: &Path) -> Vec<PathBuf> {
    let device = format!(" {} ", device.display());
    fs::read_dir("/proc")
        .unwrap()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|process| {
            fs::read_to_string(process.join("mountinfo"))
                .is_ok_and(|mounts| mounts.contains(&device))
        })
        .collect()
}

/// Writes past the test harness, which keeps what tests that pass print by `eprintln!` to itself.
fn left_out(what: &str) {
    let mut terminal = std::io::stderr();
    terminal
        .write_all(format!("LEFT OUT: {what}\n").as_bytes())
        .unwrap();
}

fn excused(variable: &str) -> bool {
    std::env::var_os(variable).is_some_and(|value| value == "1")
}

/// Whether FUSE works here; a lack of it is an error unless it is excused.
fn fuse() -> bool {
    match probe() {
        Ok(()) => true,
        Err(error) if excused("GRIDEYE_WITHOUT_FUSE") => {
            left_out(&format!("a test of /dev/i2c-N by FUSE: {error}"));
            false
        }
        Err(error) => panic!(
            "FUSE does not work here: {error}\nset GRIDEYE_WITHOUT_FUSE=1 to leave this test out"
        ),
    }
}

/// The folder of i2c-tools.
fn i2c_tools() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&path)
        .chain(["/usr/sbin", "/sbin"].map(PathBuf::from))
        .find(|folder| folder.join("i2cdetect").exists());
    if found.is_none() {
        assert!(
            excused("GRIDEYE_WITHOUT_I2C_TOOLS"),
            "i2c-tools is missing: apt-get install i2c-tools, or set GRIDEYE_WITHOUT_I2C_TOOLS=1 to leave this test out"
        );
        left_out("a test with i2c-tools");
    }
    found
}

#[test]
fn i2cdetect_sees_the_target_and_nobody_else() {
    if !fuse() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let Some(found) = bench.i2c_tool("i2cdetect", "-y BUS") else {
        return;
    };
    let expected = "     0  1  2  3  4  5  6  7  8  9  a  b  c  d  e  f\n\
        00:                         -- -- -- -- -- -- -- -- \n\
        10: -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- \n\
        20: -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- \n\
        30: -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- \n\
        40: -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- \n\
        50: -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- \n\
        60: -- -- -- -- -- -- -- -- -- 69 -- -- -- -- -- -- \n\
        70: -- -- -- -- -- -- -- --                         \n";
    assert_eq!(found, expected);
    let Some(busy) = Bench::new(AdapterMode::Busy).i2c_tool("i2cdetect", "-y BUS") else {
        return;
    };
    assert_eq!(busy.matches("UU").count(), 0x78 - 0x08, "{busy}");
}

#[test]
fn i2cdetect_lists_what_a_raspberry_pi_offers() {
    if !fuse() {
        return;
    }
    let Some(offers) = Bench::new(AdapterMode::Pi).i2c_tool("i2cdetect", "-F BUS") else {
        return;
    };
    let line = |name: &str| {
        let line = offers.lines().find(|line| line.starts_with(name));
        line.unwrap_or_else(|| panic!("no {name} in\n{offers}"))
            .ends_with("yes")
    };
    assert!(line("I2C "));
    assert!(line("SMBus Quick Command"));
    assert!(line("I2C Block Read"));
    assert!(!line("SMBus Block Read"));
    assert!(!line("SMBus Block Process Call"));
}

#[test]
fn i2cget_and_i2cset_share_one_chip_over_several_runs() {
    if !fuse() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let Some(before) = bench.i2c_tool("i2cget", "-y BUS 0x69 0x10") else {
        return;
    };
    assert_eq!(before, "0x73\n", "16 x 7 + 3");
    bench.i2c_tool("i2cset", "-y BUS 0x69 0x10 0x5a");
    assert_eq!(
        bench.i2c_tool("i2cget", "-y BUS 0x69 0x10").unwrap(),
        "0x5a\n"
    );
    assert_eq!(
        bench.i2c_tool("i2cget", "-y BUS 0x69 0x10 w").unwrap(),
        "0x7a5a\n",
        "the low byte comes first"
    );
    bench.i2c_tool("i2cset", "-y BUS 0x69 0x20 1 2 3 4 i");
    assert_eq!(
        bench.i2c_tool("i2cget", "-y BUS 0x69 0x20 i 5").unwrap(),
        "0x01 0x02 0x03 0x04 0xff\n"
    );
    assert_eq!(
        bench.adapter.lock().unwrap().bus().registers[0x20..0x24],
        [1, 2, 3, 4]
    );
}

#[test]
fn i2cdump_shows_all_registers() {
    if !fuse() {
        return;
    }
    for way in ["b", "i"] {
        let Some(dump) =
            Bench::new(AdapterMode::Pi).i2c_tool("i2cdump", &format!("-y BUS 0x69 {way}"))
        else {
            return;
        };
        let rows: Vec<&str> = dump
            .lines()
            .filter(|line| line.get(2..4) == Some(": "))
            .collect();
        assert_eq!(rows.len(), 16, "{dump}");
        for (row, line) in rows.iter().enumerate() {
            let expected: Vec<String> = (0..16)
                .map(|column| format!("{:02x}", first_value(row * 16 + column)))
                .collect();
            assert_eq!(
                &line[..51],
                format!("{row:x}0: {}", expected.join(" ")),
                "{dump}"
            );
        }
    }
}

#[test]
fn i2ctransfer_reads_128_bytes_after_one_write() {
    if !fuse() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let Some(read) = bench.i2c_tool("i2ctransfer", "-y BUS w1@0x69 0x80 r128") else {
        return;
    };
    let expected: Vec<String> = (0x80..0x100)
        .map(|register| format!("{:#04x}", first_value(register)))
        .collect();
    assert_eq!(read.trim_end(), expected.join(" "));
}

#[test]
fn a_missing_target_gives_the_errno_of_the_mode() {
    if !fuse() {
        return;
    }
    for (mode, expected) in [
        (AdapterMode::Pi, "EREMOTEIO"),
        (AdapterMode::Pi5, "EREMOTEIO"),
        (AdapterMode::Usb, "ENXIO"),
        (AdapterMode::SmbusOnly, "EOPNOTSUPP"),
        (AdapterMode::Gone, "ENODEV"),
        (AdapterMode::Virtio, "0 messages, buffer untouched"),
    ] {
        let bench = Bench::new(mode);
        let said = bench.python(
            "buffer = b'stale'\n\
             try:\n\
             \x20   count, (_, read) = rdwr(f, [(0x10, 0, b'\\x80'), (0x10, 1, buffer)])\n\
             \x20   print(count, 'messages, buffer', 'untouched' if read == buffer else 'changed')\n\
             except OSError as error:\n\
             \x20   print(errno.errorcode[error.errno].replace('ENOTSUP', 'EOPNOTSUPP') if 'OPNOT' not in errno.errorcode[error.errno] else 'EOPNOTSUPP')",
        );
        assert_eq!(said.trim(), expected, "{mode}");
    }
}

#[test]
fn python_reads_a_block_by_i2c_rdwr_and_by_plain_read_and_write() {
    if !fuse() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let said = bench.python(
        "count, (_, block) = rdwr(f, [(0x69, 0, b'\\x80'), (0x69, 1, bytes(128))])\n\
         assert count == 2 and block == bytes((n * 7 + 3) & 255 for n in range(0x80, 0x100)), block\n\
         fcntl.ioctl(f, 0x0703, 0x69)\n\
         assert os.write(f, b'\\x40\\xaa\\xbb') == 3\n\
         assert os.write(f, b'\\x40') == 1\n\
         assert os.read(f, 3) == bytes([0xaa, 0xbb, (0x42 * 7 + 3) & 255])\n\
         assert len(os.read(f, 20000)) == 8192, 'i2c-dev reads 8192 bytes at most'\n\
         assert os.write(f, bytes(20000)) == 8192, 'i2c-dev writes 8192 bytes at most'\n\
         print('done')",
    );
    assert_eq!(said, "done\n");
}

#[test]
fn hostile_calls_get_the_kernels_errno() {
    if !fuse() {
        return;
    }
    let said = Bench::new(AdapterMode::Pi).python(
        "def tried(request, argument):\n\
         \x20   try: return fcntl.ioctl(f, request, argument)\n\
         \x20   except OSError as error: return errno.errorcode[error.errno]\n\
         print(tried(0x0703, 0x80), tried(0x0799, 0), tried(0x0707, 0), tried(0x0705, 1), tried(0x0720, 12345))\n\
         try: rdwr(f, [(0x69, 0, b'\\x80'), (0x69, 1, bytes(9000))])\n\
         except OSError as error: print(errno.errorcode[error.errno])\n\
         try: os.lseek(f, 0, os.SEEK_SET)\n\
         except OSError as error: print(errno.errorcode[error.errno])\n\
         assert fcntl.ioctl(f, 0x0703, 0x69) == 0\n\
         assert os.read(f, 1) == b'\\x03'",
    );
    assert_eq!(said, "EINVAL ENOTTY EFAULT EFAULT EFAULT\nEINVAL\nESPIPE\n");
}

/// Four processes on one bus: were a transfer not atomic, one would read from another's register.
#[test]
fn transfers_of_several_processes_never_mingle() {
    if !fuse() {
        return;
    }
    let said = Bench::new(AdapterMode::Pi).python(
        "children = []\n\
         for k in range(4):\n\
         \x20   pid = os.fork()\n\
         \x20   if pid == 0:\n\
         \x20       own = os.open(DEVICE_OF(f), os.O_RDWR)\n\
         \x20       for n in range(200):\n\
         \x20           r = (n * 31 + k * 64) & 255\n\
         \x20           _, (_, block) = rdwr(own, [(0x69, 0, bytes([r])), (0x69, 1, bytes(16))])\n\
         \x20           if block != bytes((((r + i) & 255) * 7 + 3) & 255 for i in range(16)): os._exit(1)\n\
         \x20       os._exit(0)\n\
         \x20   children.append(pid)\n\
         print([os.waitpid(pid, 0)[1] for pid in children])",
    );
    assert_eq!(said, "[0, 0, 0, 0]\n");
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
fn exit_codes_and_signals_are_handed_on_and_nothing_is_left() {
    if !fuse() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let device = bench.options.device.display();
    let run = |script: String| bench.run(Command::new("sh").args(["-c", &script])).unwrap();
    assert_eq!(run("exit 37".to_owned()).code(), Some(37));
    assert_eq!(
        run(format!("exec 3<>{device}; kill -KILL $$")).signal(),
        Some(9)
    );
    assert_eq!(
        run(format!("exec 3<>{device}; kill -INT $$")).signal(),
        Some(2)
    );
    assert_eq!(
        run("true".to_owned()).code(),
        Some(0),
        "the same bench serves again"
    );
}

/// One command twice: what was arranged for the first run must not be repeated in the second.
#[test]
fn a_command_can_be_run_again() {
    if !fuse() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let mut command = Command::new("test");
    command.arg("-e").arg(&bench.options.device);
    assert!(bench.run(&mut command).unwrap().success());
    assert!(bench.run(&mut command).unwrap().success());
    assert!(
        !command.status().unwrap().success(),
        "outside there is no device"
    );
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
        matches!(fails("", "", "no-such-program"), RunError::ProgramNotFound { program } if program == "no-such-program")
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

/// The server may be root and the program not.
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
        Err(RunError::ProgramNotStarted { source, .. }) if source.raw_os_error() == Some(1) => {
            left_out("a program of another user: only root can start one");
        }
        Err(error) => panic!("{error}"),
    }
}

/// What the program leaves running loses its bus at the program's end, and does not keep `run` from returning.
#[test]
fn a_program_that_leaves_others_behind_ends_all_the_same() {
    if !fuse() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let device = bench.options.device.display();
    let script = format!(
        "import os, fcntl\nf = os.open('{device}', os.O_RDWR)\nfcntl.ioctl(f, 0x0703, 0x69)\nos.read(f, 1)\n\
         if os.fork() > 0: os._exit(7)\n\
         try:\n\
         \x20   while True: os.read(f, 1)\n\
         except OSError: os._exit(0)"
    );
    let mut command = Command::new("python3");
    command.args(["-c", &script]);
    let status = run(&bench.adapter, &bench.options, &mut command).unwrap();
    assert_eq!(status.code(), Some(7));
    wait_until_gone(&bench.options.device);
    assert_nothing_left(&bench.options.device);
}

/// The emulator's process is killed: the program finds a dead bus, as if it had been pulled out, and nothing is left.
/// The call that was under way ends with ECONNABORTED (103), every later one with ENOTCONN (107).
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
    wait_until_gone(&bench.options.device);
    assert_nothing_left(&bench.options.device);
}

/// Without root: user namespaces and a /dev/fuse that everyone may open.
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
        left_out("running as another user: only root can make the device file for it");
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

/// This test program once more, as a helper process that does what `role` says.
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

/// Does nothing as a test of its own: it is what [`role`] starts.
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
