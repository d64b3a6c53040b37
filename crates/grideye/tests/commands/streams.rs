//! Whoever reads standard output or standard error may stop, and their disk may be full: no command panics, and only a
//! result that cannot be written changes how it ends.

use crate::{Fixture, ROOM};
use std::process::{Command, Stdio};

/// Commands, each with its exit code. `--collector` names a port where nobody answers.
const COMMANDS: &[(&str, i32)] = &[
    ("compare --scene room.toml --recording recording.csv", 0),
    (
        "compare --scene room.toml --recording recording.csv --json -",
        0,
    ),
    ("compare --scene room.toml --recording hotter.csv", 1),
    ("compare --scene room.toml --recording short.csv", 3),
    ("simulate room.toml --out x.csv", 0),
    ("simulate outside.toml --out x.csv", 0),
    ("convert recording.csv x.parquet", 0),
    ("count recording.csv", 0),
    ("count recording.csv --json -", 0),
    ("characterize recording.csv", 0),
    ("characterize short.csv", 3),
    ("characterize recording.csv --profile x.toml", 3),
    ("calibrate --scene room.toml --recording recording.csv", 2),
    ("coverage room.toml", 0),
    ("distinguish room.toml hotter.toml", 0),
    ("fuse room.toml --json -", 0),
    ("dataset room.toml --out x --frames 3", 0),
    ("emulate --constant 20 -- true", 0),
    ("emulate --constant 20 -- sh seven.sh", 7),
    ("emulate --constant 20 --socket x.sock --seconds 0.01", 0),
    (
        "emulate --constant 20 --json --socket x.sock --seconds 0.01",
        0,
    ),
    ("enroll ana --access x", 0),
    ("token make ana --scope read --access x", 0),
    ("audit --collector http://127.0.0.1:9", 1),
    ("record evening --collector http://127.0.0.1:9", 1),
    ("orient --collector http://127.0.0.1:9", 1),
    ("mqtt forget", 2),
    ("migrate nothing.sqlite x.sqlite", 2),
    ("backup nothing.sqlite x.sqlite", 2),
    ("restore nothing.sqlite --store x.sqlite", 2),
    ("demo --once --out x --scene nothing.toml", 2),
    ("completions bash", 0),
    ("man x", 0),
    ("compare --recording", 2),
    ("--help", 0),
    ("compare --help-all", 0),
    ("--version", 0),
];

fn fixture() -> Fixture {
    let fixture = Fixture::new();
    fixture.put(
        "hotter.toml",
        ROOM.replace("temperature_c = 30", "temperature_c = 60"),
    );
    fixture.put("outside.toml", ROOM.to_owned() + "[[object]]\nname = \"lamp\"\nposition_mm = [9000, 0, 0]\nsize_mm = [100, 100, 100]\ntemperature_c = 50\n");
    fixture.put("seven.sh", "exit 7\n");
    let made = fixture.run(&["simulate", "hotter.toml", "--out", "hotter.csv"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let recording = std::fs::read_to_string(fixture.path("recording.csv")).unwrap();
    let short: String = recording
        .lines()
        .take(4)
        .flat_map(|line| [line, "\n"])
        .collect();
    fixture.put("short.csv", short);
    fixture
}

/// The writing end of a pipe that nobody reads any more.
fn unread() -> Stdio {
    let mut reader = Command::new("true").stdin(Stdio::piped()).spawn().unwrap();
    let pipe = reader.stdin.take().unwrap();
    reader.wait().unwrap();
    pipe.into()
}

type Stream = fn() -> Stdio;

fn full() -> Stdio {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
    full.unwrap().into()
}

/// How the command ends, and what it prints where that is a pipe to here: standard output, then standard error.
fn ended(
    fixture: &Fixture,
    command: &str,
    stdout: Stdio,
    stderr: Stdio,
) -> (Option<i32>, [String; 2]) {
    for made in ["x", "x.csv", "x.parquet", "x.toml", "x.sqlite"] {
        let path = fixture.path(made);
        drop(std::fs::remove_dir_all(&path).or_else(|_| std::fs::remove_file(&path)));
    }
    let output = Command::new(env!("CARGO_BIN_EXE_grideye"))
        .args(command.split(' '))
        .current_dir(fixture.folder.path())
        .stdin(Stdio::null())
        .stdout(stdout)
        .stderr(stderr)
        .spawn()
        .unwrap()
        .wait_with_output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code(),
        [text(&output.stdout), text(&output.stderr)],
    )
}

#[test]
fn a_command_ends_the_same_when_nobody_reads_on_and_only_a_lost_result_is_an_error() {
    let fixture = fixture();
    for (command, code) in COMMANDS {
        let (found, [printed, said]) = ended(&fixture, command, Stdio::piped(), Stdio::piped());
        assert_eq!(found, Some(*code), "{command}: {said}");
        let ways: [(&str, Stream, Stream); 4] = [
            ("2>&1 | head", unread, unread),
            ("| head", unread, Stdio::piped),
            ("2>/dev/full", Stdio::piped, full),
            ("2> >(head)", Stdio::piped, unread),
        ];
        for (name, stdout, stderr) in ways {
            let (found, said) = ended(&fixture, command, stdout(), stderr());
            assert_eq!(found, Some(*code), "{command} {name}: {said:?}");
        }
        let (found, [_, said]) = ended(&fixture, command, full(), Stdio::piped());
        let lost = "error: cannot write the ";
        let expected = if printed.is_empty() { *code } else { 1 };
        assert_eq!(found, Some(expected), "{command} >/dev/full: {said}");
        assert_eq!(
            said.contains(lost),
            !printed.is_empty(),
            "{command} >/dev/full: {said}"
        );
    }
}
