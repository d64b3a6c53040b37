//! How it ends: by itself, by signals, with the program; the exit code, what is said last, and nothing left behind.

use crate::support::{Ended, Server, emulate, pixels, run, signal_process, wait, wait_for};
use rustix::fs::OFlags;
use rustix::process::Signal;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use std::fs::File;
use std::io::Write as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

#[test]
fn a_server_ends_on_either_signal_and_says_what_went_over_its_bus() {
    for signal in [Signal::INT, Signal::TERM] {
        let server = Server::start(&["--constant", "21"]);
        let mut client = server.client(1);
        pixels(&mut client, 0x69);
        assert!(crate::client::Client::connect(server.socket(), 1).is_ok());
        server.signal(signal);
        let ended = server.wait();
        assert_eq!(ended.code, 0, "{ended:?}");
        // Two addresses, the register, and 128 bytes.
        let counts = "1 transactions, 131 bytes, 0 not acknowledged";
        assert!(ended.stderr.contains(counts), "{ended:?}");
        assert!(
            ended.stderr.contains("sensor at 1:0x69, showing 21 °C"),
            "{ended:?}"
        );
    }
}

#[test]
fn a_server_ends_when_its_time_is_up() {
    let started = Instant::now();
    let ended = Server::start(&["--constant", "21", "--seconds", "0.3"]).wait();
    assert_eq!(ended.code, 0, "{ended:?}");
    assert!(started.elapsed() >= Duration::from_millis(300));
}

#[test]
fn the_socket_of_a_server_that_was_killed_is_taken_over() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("amg.sock");
    let start = || {
        let mut child = emulate(&["--constant", "21", "--quiet", "--socket"])
            .arg(&socket)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let client = wait_for("the server", || {
            crate::client::Client::connect(&socket, 1).ok().or_else(|| {
                assert!(child.try_wait().unwrap().is_none(), "the server ended");
                None
            })
        });
        (child, client)
    };
    let (mut killed, client) = start();
    signal_process(killed.id(), Signal::KILL);
    killed.wait().unwrap();
    drop(client);
    assert!(socket.exists(), "what SIGKILL leaves behind");
    let (mut next, mut client) = start();
    assert_eq!(pixels(&mut client, 0x69), [84; 64]);
    signal_process(next.id(), Signal::TERM);
    assert_eq!(wait(&mut next), 0);
    assert!(!socket.exists());
}

fn with_a_program(arguments: &[&str], script: &str) -> Ended {
    run(emulate(arguments).args(["--", "sh", "-c", script]))
}

#[test]
fn the_exit_code_is_the_programs_and_a_killed_one_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("amg.sock");
    for (script, code) in [
        ("exit 0", 0),
        ("exit 7", 7),
        ("kill -KILL $$", 137),
        ("kill -TERM $$", 143),
    ] {
        let arguments = ["--constant", "21"];
        let ended = with_a_program(&arguments, script);
        assert_eq!(ended.code, code, "{script}: {ended:?}");
        assert!(
            ended.stderr.contains("sh never opened /dev/i2c-1"),
            "{ended:?}"
        );
        let served = [&arguments[..], &["--socket", socket.to_str().unwrap()]].concat();
        assert_eq!(with_a_program(&served, script).code, code, "{script}");
        assert!(!socket.exists(), "{script}");
    }
}

#[test]
fn quiet_says_nothing_and_json_says_it_to_programs() {
    let quiet = Server::start(&["--constant", "21", "--quiet", "--seconds", "0.1"]).wait();
    assert_eq!(quiet.stderr, "");

    let ended = with_a_program(
        &["--constant", "21", "--json", "--sensor", "a=3:0x70.2:0x68"],
        "echo mine; exit 5",
    );
    assert_eq!(
        (ended.code, ended.stdout.as_str()),
        (5, "mine\n"),
        "{ended:?}"
    );
    let lines: Vec<serde_json::Value> = ended
        .stderr
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(lines.len(), 2);
    assert_eq!(lines[0]["event"], "ready");
    assert_eq!(lines[0]["at"][0], "/dev/i2c-3");
    assert_eq!(lines[0]["sensors"][0]["channel"], 2);
    assert_eq!(lines[1]["event"], "end");
    assert_eq!(lines[1]["program_exit_code"], 5);
    assert_eq!(lines[1]["counts"]["transactions"], 0);
}

#[test]
fn a_signal_is_the_programs_and_nothing_is_left_behind() {
    let told = ToldToEnd::new("TERM");
    let mut child = told.command().stdout(Stdio::piped()).spawn().unwrap();
    told.wait_until_ready();
    signal_process(child.id(), Signal::TERM);
    assert_eq!(wait(&mut child), 9);
    let said = std::io::read_to_string(child.stdout.take().unwrap()).unwrap();
    assert_eq!(said, "caught TERM\n");
    assert!(!told.socket().exists());
}

/// The terminal tells the program itself, so it is told once and not by both.
#[test]
fn ctrl_c_at_a_terminal_reaches_the_program_once() {
    let told = ToldToEnd::new("INT");
    let (mut keyboard, terminal) = terminal();
    let said = tempfile::NamedTempFile::new().unwrap();
    let emulate = told.command();
    let mut session = Command::new("setsid");
    session
        .args(["--ctty", "--wait"])
        .arg(emulate.get_program())
        .args(emulate.get_args())
        .current_dir(emulate.get_current_dir().unwrap())
        .stdin(terminal)
        .stdout(said.reopen().unwrap());
    let mut child = session.spawn().unwrap();
    told.wait_until_ready();
    keyboard.write_all(b"\x03").unwrap();
    assert_eq!(wait(&mut child), 9);
    assert_eq!(
        std::fs::read_to_string(said.path()).unwrap(),
        "caught INT\n"
    );
    assert!(!told.socket().exists());
}

/// A program that says every signal that it catches. It looks for them all the time: two that come while a shell sleeps
/// are one to it.
struct ToldToEnd {
    folder: tempfile::TempDir,
    signal: &'static str,
}

impl ToldToEnd {
    fn new(signal: &'static str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        Self { folder, signal }
    }

    fn socket(&self) -> PathBuf {
        self.folder.path().join("amg.sock")
    }

    fn ready(&self) -> PathBuf {
        self.folder.path().join("ready")
    }

    fn command(&self) -> Command {
        let script = format!(
            "n=; trap 'echo caught {signal}; n=1' {signal}; touch {}; while [ -z \"$n\" ]; do :; done; sleep 0.2; exit 9",
            self.ready().display(),
            signal = self.signal,
        );
        let mut command = emulate(&["--constant", "21", "--quiet", "--socket"]);
        command.arg(self.socket()).args(["--", "sh", "-c", &script]);
        command
    }

    fn wait_until_ready(&self) {
        wait_for("the program", || self.ready().exists().then_some(()));
    }
}

/// A pseudo-terminal: what types into it, and what a program has as its terminal.
fn terminal() -> (File, File) {
    let keyboard = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&keyboard).unwrap();
    unlockpt(&keyboard).unwrap();
    let name = ptsname(&keyboard, Vec::new()).unwrap();
    let terminal = File::options()
        .read(true)
        .write(true)
        .custom_flags(i32::try_from(OFlags::NOCTTY.bits()).unwrap())
        .open(name.to_str().unwrap())
        .unwrap();
    (File::from(keyboard), terminal)
}

#[test]
fn a_program_beside_usbip_is_run_and_told_to_end() {
    let ended = run(&mut emulate(&[
        "--constant",
        "21",
        "--usbip",
        "127.0.0.1:0",
        "--",
        "sh",
        "-c",
        "exit 4",
    ]));
    assert_eq!(ended.code, 4, "{ended:?}");
    assert!(ended.stderr.contains("usbip --tcp-port"), "{ended:?}");

    let folder = tempfile::tempdir().unwrap();
    let ready = folder.path().join("ready");
    let script = format!(
        "trap 'exit 9' TERM; touch {}; while :; do sleep 0.05; done",
        ready.display()
    );
    let mut child = emulate(&[
        "--constant",
        "21",
        "--quiet",
        "--usbip",
        "127.0.0.1:0",
        "--",
        "sh",
        "-c",
        &script,
    ])
    .spawn()
    .unwrap();
    wait_for("the program", || ready.exists().then_some(()));
    signal_process(child.id(), Signal::TERM);
    assert_eq!(wait(&mut child), 9);
}

#[test]
fn the_trace_is_whole_when_the_program_has_ended() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("bus.csv");
    let old = "time_s,bus\n";
    std::fs::write(&trace, old).unwrap();
    let server = Server::start(&["--constant", "21", "--trace", trace.to_str().unwrap()]);
    let mut client = server.client(1);
    pixels(&mut client, 0x69);
    assert_eq!(std::fs::read_to_string(&trace).unwrap(), old);
    server.signal(Signal::TERM);
    let ended = server.wait();
    assert!(ended.stderr.contains("bus.csv: 2 messages"), "{ended:?}");
    let text = std::fs::read_to_string(&trace).unwrap();
    let rows: Vec<Vec<&str>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').collect())
        .collect();
    assert_eq!(rows.len(), 2, "{text}");
    assert_eq!(
        (rows[0][1], rows[0][4], rows[0][5], rows[0][6]),
        ("i2c-1", "0x69", "write", "0x80")
    );
    assert_eq!((rows[1][3], rows[1][5]), ("Sr", "read"));
    assert!(rows[1][6].starts_with("0x54 0x00 0x54 0x00"), "{text}");
    assert_eq!(rows[1][6].split(' ').count(), 128);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_trace_for_a_logic_analyzer_is_a_value_change_dump() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("bus.vcd");
    let server = Server::start(&["--constant", "21", "--trace", trace.to_str().unwrap()]);
    pixels(&mut server.client(1), 0x69);
    server.signal(Signal::TERM);
    server.wait();
    let text = std::fs::read_to_string(&trace).unwrap();
    assert!(
        text.contains("$enddefinitions") && text.contains("#0"),
        "{text}"
    );
}
