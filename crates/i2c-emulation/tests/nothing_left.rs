//! However the processes end, nothing remains: no process, mount, socket or file; and signals reach the program once.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

#[expect(dead_code, reason = "each test program uses some of it")]
mod common;

use std::fs;
use std::io::{BufRead, BufReader, Lines};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};

use common::{
    Bench, RegisterFile, assert_nothing_left, fuse_works, fuse_works_for_a_part, processes,
    python_works, skip, wait_until,
};
use i2c_emulation::adapter::HalAdapter;
use i2c_emulation::ioctl::AdapterMode;
use i2c_emulation::program::{self, Options, Via};
use i2c_emulation::rack::{Rack, SharedAdapter};

/// Tells the helper process what to do: the way, the bus number, the FUSE device, and the script.
const ROLE: &str = "I2C_EMULATION_TEST_RUN";

/// Opens the device and reports that it reads. `on_signal` is its handler for SIGTERM, SIGINT and SIGHUP; it writes its
/// line at once, because a second signal may interrupt it.
const READS: &str = "import os, sys, fcntl, signal, time\n\
    caught = []\n\
    def on_signal(number, frame):\n\
    \x20   caught.append(number)\n\
    \x20   os.write(1, b'\\nprogram: signal %d\\n' % number)\n\
    f = os.open(DEVICE, os.O_RDWR)\n\
    fcntl.ioctl(f, 0x0703, 0x69)\n\
    os.read(f, 1)\n\
    print('\\nsocket:' + os.environ.get('I2C_EMULATION_PRELOAD', '').split(':')[0], flush=True)\n";

const WAITS: &str = "print('\\nprogram: reading', flush=True)\nwhile True: time.sleep(0.01)\n";

/// One run of the emulator in its own process.
struct Emulator {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
    number: u32,
    device: PathBuf,
    /// The name of its socket, once the program has printed it; FUSE has none.
    socket: String,
}

impl Emulator {
    fn start(via: Via, script: &str) -> Self {
        Self::start_as(via, script, |_| {})
    }

    fn start_as(via: Via, script: &str, prepare: impl FnOnce(&mut Command)) -> Self {
        let bench = Bench::new(via, AdapterMode::Pi);
        let (number, device) = (bench.number, bench.device());
        let script = format!("DEVICE = '{}'\n{script}", device.display());
        let mut command = helper(via, number, "/dev/fuse", &script);
        prepare(&mut command);
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        Self {
            child,
            lines,
            number,
            device,
            socket: String::new(),
        }
    }

    /// The next line of the program or helper; `None` once all possible writers have ended.
    fn next(&mut self) -> Option<String> {
        for line in self.lines.by_ref().map(Result::unwrap) {
            if let Some(name) = line.strip_prefix("socket:") {
                name.clone_into(&mut self.socket);
            } else if line.starts_with("program:") || line.starts_with("helper:") {
                return Some(line);
            }
        }
        None
    }

    fn expect(&mut self, line: &str) {
        assert_eq!(self.next().as_deref(), Some(line));
    }

    fn signal(&self, name: &str) {
        let pid = self.child.id().to_string();
        let sent = Command::new("kill").args(["-s", name, &pid]).status();
        assert!(sent.unwrap().success());
    }

    /// Kills the emulator's process with the one signal it cannot handle.
    fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Waits for the end, then checks that nothing of this run remains.
    fn assert_nothing_left(mut self) {
        self.child.wait().unwrap();
        let marks = [format!("DEVICE = '{}'", self.device.display())];
        wait_until(|| {
            processes_with(&marks[0]).is_empty()
                && common::processes_that_mount(&self.device).is_empty()
        });
        assert_nothing_left(&self.device);
        let sockets = fs::read_to_string("/proc/net/unix").unwrap();
        assert!(
            self.socket.is_empty() || !sockets.contains(&self.socket),
            "the socket {} was left behind",
            self.socket
        );
        let number = self.number.to_string();
        for folder in ["/tmp", "/dev/shm", "/run", "/var/tmp"] {
            let left: Vec<_> = fs::read_dir(folder)
                .into_iter()
                .flatten()
                .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
                .filter(|name| name.contains("i2c-emulation") || name.contains(&number))
                .collect();
            assert!(left.is_empty(), "left in {folder}: {left:?}");
        }
    }
}

/// Identifies a helper process of this file by its command line.
const ROLE_ARGUMENT: &str = "helper_process_of_nothing_left";

fn processes_with(mark: &str) -> Vec<PathBuf> {
    let own = PathBuf::from(format!("/proc/{}", std::process::id()));
    processes()
        .filter(|process| *process != own)
        .filter(|process| {
            let line = fs::read(process.join("cmdline")).unwrap_or_default();
            String::from_utf8_lossy(&line).contains(mark)
        })
        .collect()
}

fn helper(via: Via, number: u32, fuse_device: &str, script: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", ROLE_ARGUMENT, "--nocapture", "--test-threads=1"])
        .env(ROLE, format!("{via}\n{number}\n{fuse_device}\n{script}"));
    command
}

/// Not a test itself: [`helper`] starts it.
#[test]
fn helper_process_of_nothing_left() {
    let Ok(role) = std::env::var(ROLE) else {
        return;
    };
    let mut fields = role.splitn(4, '\n');
    let mut field = || fields.next().unwrap();
    let via: Via = field().parse().unwrap();
    let number: u32 = field().parse().unwrap();
    let options = Options {
        via,
        fuse_device: field().into(),
        ..Options::default()
    };
    let mut rack = Rack::new();
    rack.insert(
        number,
        SharedAdapter::new(HalAdapter::new(RegisterFile::new())),
    );
    let mut command = Command::new("python3");
    command.args(["-c", field()]).env_remove(ROLE);
    match program::run(&rack, &options, &mut command) {
        Ok(ended) => {
            let (code, signal) = (ended.status.code(), ended.status.signal());
            println!("\nhelper: code {code:?} signal {signal:?}");
        }
        Err(error) => println!("\nhelper: {error}"),
    }
}

fn ways() -> impl Iterator<Item = Via> {
    [Via::Fuse, Via::Preload]
        .into_iter()
        .filter(|via| *via == Via::Preload || fuse_works_for_a_part())
}

#[test]
fn a_killed_emulator_takes_its_program_with_it() {
    if !python_works() {
        return;
    }
    for via in ways() {
        let mut emulator = Emulator::start(via, &format!("{READS}{WAITS}"));
        emulator.expect("program: reading");
        emulator.kill();
        assert_eq!(emulator.next(), None, "{via}: the program has ended");
        emulator.assert_nothing_left();
    }
}

/// A program that ignores SIGTERM finds a dead bus: ENOTCONN (107) for every call and every new open, after the FUSE
/// call in progress has ended with ECONNABORTED (103).
#[test]
fn a_program_that_outlives_its_emulator_finds_a_dead_bus() {
    if !python_works() {
        return;
    }
    for via in ways() {
        let script = format!(
            "{READS}signal.signal(signal.SIGTERM, on_signal)\n\
             print('\\nprogram: reading', flush=True)\n\
             while not caught: time.sleep(0.01)\n\
             while True:\n\
             \x20   try: os.read(f, 1)\n\
             \x20   except OSError as error:\n\
             \x20       if error.errno != 103: break\n\
             for what in (lambda: os.read(f, 1), lambda: os.write(f, b'1'), lambda: fcntl.ioctl(f, 0x0705, bytes(8)), lambda: os.open(DEVICE, os.O_RDWR)):\n\
             \x20   try: what(); print('\\nprogram: works', flush=True)\n\
             \x20   except OSError as error: print('\\nprogram: errno', error.errno, flush=True)\n"
        );
        let mut emulator = Emulator::start(via, &script);
        emulator.expect("program: reading");
        emulator.kill();
        emulator.expect("program: signal 15");
        // The kernel may send it again for every thread that became the program's parent in the meantime.
        let rest: Vec<String> = std::iter::from_fn(|| emulator.next())
            .filter(|line| line != "program: signal 15")
            .collect();
        assert_eq!(rest, ["program: errno 107"; 4], "{via}");
        emulator.assert_nothing_left();
    }
}

#[test]
fn signals_to_the_emulator_are_the_programs() {
    if !python_works() {
        return;
    }
    for via in ways() {
        for (name, number) in [("TERM", 15), ("INT", 2), ("HUP", 1), ("QUIT", 3)] {
            let script = format!(
                "{READS}signal.signal({number}, on_signal)\n\
                 print('\\nprogram: reading', flush=True)\n\
                 while not caught: time.sleep(0.01)\n\
                 time.sleep(0.05)\n\
                 sys.exit(40 + len(caught))"
            );
            let mut emulator = Emulator::start(via, &script);
            emulator.expect("program: reading");
            emulator.signal(name);
            emulator.expect(&format!("program: signal {number}"));
            emulator.expect("helper: code Some(41) signal None");
            emulator.assert_nothing_left();
        }
    }
}

#[test]
fn a_signal_that_ends_the_program_is_handed_back() {
    if !python_works() {
        return;
    }
    for via in ways() {
        let mut emulator = Emulator::start(via, &format!("{READS}{WAITS}"));
        emulator.expect("program: reading");
        emulator.signal("TERM");
        emulator.expect("helper: code None signal Some(15)");
        emulator.assert_nothing_left();
        let script = format!("{READS}os.kill(os.getpid(), 9)");
        let mut emulator = Emulator::start(via, &script);
        emulator.expect("helper: code None signal Some(9)");
        emulator.assert_nothing_left();
    }
}

/// A terminal signals both the emulator and the program. The program must get the signal once, and decide.
#[test]
fn control_c_reaches_the_program_once() {
    if !python_works() {
        return;
    }
    const TERMINAL: &str = "import os, pty, sys\n\
        pid, terminal = pty.fork()\n\
        if pid == 0: os.execv(sys.argv[1], sys.argv[1:])\n\
        seen = b''\n\
        while b'program: reading' not in seen: seen += os.read(terminal, 4096)\n\
        os.write(terminal, b'\\x03')\n\
        while True:\n\
        \x20   try: more = os.read(terminal, 4096)\n\
        \x20   except OSError: break\n\
        \x20   if not more: break\n\
        \x20   seen += more\n\
        os.waitpid(pid, 0)\n\
        sys.stdout.buffer.write(seen)";
    for via in ways() {
        let script = format!(
            "{READS}signal.signal(2, on_signal)\n\
             print('\\nprogram: reading', flush=True)\n\
             while not caught: time.sleep(0.01)\n\
             time.sleep(0.1)\n\
             sys.exit(40 + len(caught))"
        );
        let bench = Bench::new(via, AdapterMode::Pi);
        let device = bench.device();
        let script = format!("DEVICE = '{}'\n{script}", device.display());
        let inner = helper(via, bench.number, "/dev/fuse", &script);
        let mut outer = Command::new("python3");
        outer.args(["-c", TERMINAL]).arg(inner.get_program());
        outer.args(inner.get_args());
        for (name, value) in inner.get_envs() {
            outer.env(name, value.unwrap());
        }
        let output = outer.output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        assert_eq!(
            said.matches("program: signal 2").count(),
            1,
            "{via}: {said}"
        );
        assert!(said.contains("helper: code Some(41)"), "{via}: {said}");
        assert_nothing_left(&device);
    }
}

/// If nohup or a shell made the emulator ignore a signal, the program ignores it too, as without an emulator.
#[test]
fn an_ignored_signal_stays_ignored() {
    if !python_works() {
        return;
    }
    for via in ways() {
        let script = format!(
            "{READS}print('\\nprogram: ignores', signal.getsignal(signal.SIGHUP) == signal.SIG_IGN, flush=True)\n{WAITS}"
        );
        let mut emulator = Emulator::start_as(via, &script, |command| {
            let program = command.get_program().to_owned();
            let arguments: Vec<_> = command.get_args().map(ToOwned::to_owned).collect();
            let role = command.get_envs().next().unwrap().1.unwrap().to_owned();
            *command = Command::new("sh");
            command
                .args(["-c", "trap '' HUP; exec \"$@\"", "sh"])
                .arg(program)
                .args(arguments)
                .env(ROLE, role);
        });
        emulator.expect("program: ignores True");
        emulator.expect("program: reading");
        emulator.signal("HUP");
        emulator.signal("TERM");
        emulator.expect("helper: code None signal Some(15)");
        emulator.assert_nothing_left();
    }
}

/// Without root, the program's own process makes its namespaces and must still get the signal.
#[test]
fn a_killed_emulator_without_root_takes_its_program_with_it() {
    if !python_works() {
        return;
    }
    const NOBODY: u32 = 65534;
    if !fuse_works() {
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
    open_to_all(folder.path());
    let mut emulator = Emulator::start_as(Via::Fuse, &format!("{READS}{WAITS}"), |command| {
        let role = command.get_envs().next().unwrap().1.unwrap().to_owned();
        let role = role.into_string().unwrap();
        let role = role.replacen("/dev/fuse", node.to_str().unwrap(), 1);
        command.env(ROLE, role).uid(NOBODY).gid(NOBODY);
    });
    emulator.expect("program: reading");
    emulator.kill();
    assert_eq!(emulator.next(), None, "the program has ended");
    emulator.assert_nothing_left();
}

fn open_to_all(folder: &Path) {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).unwrap();
}
