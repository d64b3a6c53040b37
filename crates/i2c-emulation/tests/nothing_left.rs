//! However the processes end, nothing remains: no process, mount, socket or file; and signals reach the program once.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

#[expect(dead_code, reason = "each test program uses some of it")]
mod common;

use std::fs;
use std::io::{BufRead, BufReader, Lines};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child, ChildStdout, Command, Stdio};

use common::{Bench, RegisterFile, assert_nothing_left, processes, python_works, skip, wait_until};
use i2c_emulation::adapter::HalAdapter;
use i2c_emulation::ioctl::AdapterMode;
use i2c_emulation::program::{self, Options};
use i2c_emulation::rack::{Rack, SharedAdapter};

/// Tells the helper process what to do: the bus number, and the script.
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
    os.read(f, 1)\n";

const WAITS: &str = "print('\\nprogram: reading', flush=True)\nwhile True: time.sleep(0.01)\n";

/// One run of the emulator in its own process.
struct Emulator {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
    number: u32,
    device: PathBuf,
}

impl Emulator {
    fn start(script: &str) -> Self {
        Self::start_as(script, |_| {})
    }

    fn start_as(script: &str, prepare: impl FnOnce(&mut Command)) -> Self {
        let bench = Bench::new(AdapterMode::Pi);
        let (number, device) = (bench.number, bench.device());
        let script = format!("DEVICE = '{}'\n{script}", device.display());
        let mut command = helper(number, &script);
        prepare(&mut command);
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        Self {
            child,
            lines,
            number,
            device,
        }
    }

    /// The next line of the program or helper; `None` once all possible writers have ended.
    fn next(&mut self) -> Option<String> {
        let mut lines = self.lines.by_ref().map(Result::unwrap);
        lines.find(|line| line.starts_with("program:") || line.starts_with("helper:"))
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
        // In the program's command line, and in the environment of the helper and of its caretaker.
        let mark = format!("DEVICE = '{}'", self.device.display());
        wait_until(|| processes_with(&mark).is_empty());
        assert_nothing_left(&self.device);
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

const ROLE_ARGUMENT: &str = "helper_process_of_nothing_left";

fn processes_with(mark: &str) -> Vec<PathBuf> {
    let own = PathBuf::from(format!("/proc/{}", std::process::id()));
    processes()
        .filter(|process| *process != own)
        .filter(|process| {
            ["cmdline", "environ"].into_iter().any(|text| {
                let text = fs::read(process.join(text)).unwrap_or_default();
                String::from_utf8_lossy(&text).contains(mark)
            })
        })
        .collect()
}

fn helper(number: u32, script: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", ROLE_ARGUMENT, "--nocapture", "--test-threads=1"])
        .env(ROLE, format!("{number}\n{script}"));
    command
}

/// Not a test itself: [`helper`] starts it.
#[test]
fn helper_process_of_nothing_left() {
    let Ok(role) = std::env::var(ROLE) else {
        return;
    };
    let (number, script) = role.split_once('\n').unwrap();
    let number: u32 = number.parse().unwrap();
    let mut rack = Rack::new();
    rack.insert(
        number,
        SharedAdapter::new(HalAdapter::new(RegisterFile::new())),
    );
    let mut command = Command::new("python3");
    command.args(["-c", script]).env_remove(ROLE);
    match program::run(&rack, &Options::default(), &mut command) {
        Ok(ended) => {
            let (code, signal) = (ended.status.code(), ended.status.signal());
            println!("\nhelper: code {code:?} signal {signal:?}");
        }
        Err(error) => println!("\nhelper: {error}"),
    }
}

#[test]
fn a_killed_emulator_takes_its_program_with_it() {
    if !python_works() {
        return;
    }
    let mut emulator = Emulator::start(&format!("{READS}{WAITS}"));
    emulator.expect("program: reading");
    emulator.kill();
    assert_eq!(emulator.next(), None, "the program has ended");
    emulator.assert_nothing_left();
}

/// A program that ignores SIGTERM finds a dead bus: ENOTCONN (107) for every call and every new open.
#[test]
fn a_program_that_outlives_its_emulator_finds_a_dead_bus() {
    if !python_works() {
        return;
    }
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
    let mut emulator = Emulator::start(&script);
    emulator.expect("program: reading");
    emulator.kill();
    emulator.expect("program: signal 15");
    // The kernel may send it again for every thread that became the program's parent in the meantime.
    let rest: Vec<String> = std::iter::from_fn(|| emulator.next())
        .filter(|line| line != "program: signal 15")
        .collect();
    assert_eq!(rest, ["program: errno 107"; 4]);
    emulator.assert_nothing_left();
}

#[test]
fn signals_to_the_emulator_are_the_programs() {
    if !python_works() {
        return;
    }
    for (name, number) in [("TERM", 15), ("INT", 2), ("HUP", 1), ("QUIT", 3)] {
        let script = format!(
            "{READS}signal.signal({number}, on_signal)\n\
             print('\\nprogram: reading', flush=True)\n\
             while not caught: time.sleep(0.01)\n\
             time.sleep(0.05)\n\
             sys.exit(40 + len(caught))"
        );
        let mut emulator = Emulator::start(&script);
        emulator.expect("program: reading");
        emulator.signal(name);
        emulator.expect(&format!("program: signal {number}"));
        emulator.expect("helper: code Some(41) signal None");
        emulator.assert_nothing_left();
    }
}

#[test]
fn a_signal_that_ends_the_program_is_handed_back() {
    if !python_works() {
        return;
    }
    let mut emulator = Emulator::start(&format!("{READS}{WAITS}"));
    emulator.expect("program: reading");
    emulator.signal("TERM");
    emulator.expect("helper: code None signal Some(15)");
    emulator.assert_nothing_left();
    let script = format!("{READS}os.kill(os.getpid(), 9)");
    let mut emulator = Emulator::start(&script);
    emulator.expect("helper: code None signal Some(9)");
    emulator.assert_nothing_left();
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
    let script = format!(
        "{READS}signal.signal(2, on_signal)\n\
         print('\\nprogram: reading', flush=True)\n\
         while not caught: time.sleep(0.01)\n\
         time.sleep(0.1)\n\
         sys.exit(40 + len(caught))"
    );
    let bench = Bench::new(AdapterMode::Pi);
    let device = bench.device();
    let script = format!("DEVICE = '{}'\n{script}", device.display());
    let inner = helper(bench.number, &script);
    let mut outer = Command::new("python3");
    outer.args(["-c", TERMINAL]).arg(inner.get_program());
    outer.args(inner.get_args());
    for (name, value) in inner.get_envs() {
        outer.env(name, value.unwrap());
    }
    let output = outer.output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(said.matches("program: signal 2").count(), 1, "{said}");
    assert!(said.contains("helper: code Some(41)"), "{said}");
    assert_nothing_left(&device);
}

/// If nohup or a shell made the emulator ignore a signal, the program ignores it too, as without an emulator.
#[test]
fn an_ignored_signal_stays_ignored() {
    if !python_works() {
        return;
    }
    let script = format!(
        "{READS}print('\\nprogram: ignores', signal.getsignal(signal.SIGHUP) == signal.SIG_IGN, flush=True)\n{WAITS}"
    );
    let mut emulator = Emulator::start_as(&script, |command| {
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

/// Without root, the program cannot gain rights, and all else is the same.
#[test]
fn a_killed_emulator_without_root_takes_its_program_with_it() {
    const NOBODY: u32 = 65534;
    if !python_works() || !is_root("an emulator of another user") {
        return;
    }
    let script = format!("{READS}print('\\nprogram: user', os.getuid(), flush=True)\n{WAITS}");
    let mut emulator = Emulator::start_as(&script, |command| {
        command.uid(NOBODY).gid(NOBODY);
    });
    emulator.expect("program: user 65534");
    emulator.expect("program: reading");
    emulator.kill();
    assert_eq!(emulator.next(), None, "the program has ended");
    emulator.assert_nothing_left();
}

/// The program is killed, and then a thread of it in a transfer: the emulator goes on to the end.
#[test]
fn a_killed_program_ends_the_run() {
    if !python_works() {
        return;
    }
    let script = format!(
        "{READS}import threading\n\
         def work():\n\
         \x20   while True: os.read(f, 100)\n\
         for n in range(4): threading.Thread(target=work, daemon=True).start()\n\
         print('\\nprogram: reading', flush=True)\n\
         time.sleep(0.05)\n\
         os.kill(os.getpid(), 9)"
    );
    let mut emulator = Emulator::start(&script);
    emulator.expect("program: reading");
    emulator.expect("helper: code None signal Some(9)");
    emulator.assert_nothing_left();
}

fn is_root(what: &str) -> bool {
    let is_root = rustix::process::geteuid().is_root();
    if !is_root {
        skip::test(&format!("{what}: only root can start one"));
    }
    is_root
}
