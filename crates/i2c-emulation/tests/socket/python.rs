//! The Python client against a real server, and method by method against the real smbus2.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use i2c_emulation::ioctl::AdapterMode;
use i2c_emulation::program;
use i2c_emulation::rack::{Rack, SharedAdapter};
use i2c_emulation::socket::Options;

use crate::bench::{Bench, Log, RegisterFile};
use crate::skip;

/// The version behind the recorded outputs.
const SMBUS2: &str = "smbus2==0.6.1";

fn excused(variable: &str) -> bool {
    std::env::var_os(variable).is_some_and(|value| value == "1")
}

/// Python, if available; a missing one is an error unless excused.
pub(crate) fn python() -> Option<Command> {
    let found = Command::new("python3")
        .arg("--version")
        .output()
        .is_ok_and(|output| output.status.success());
    if !found {
        assert!(
            excused("GRIDEYE_WITHOUT_I2C_TOOLS"),
            "python3 is missing: install it, or set GRIDEYE_WITHOUT_I2C_TOOLS=1 to leave this test out"
        );
        skip::test("a test of the Python client");
        return None;
    }
    let mut command = Command::new("python3");
    command
        .env("PYTHONPATH", folder("python"))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env_remove("GRIDEYE_I2C_SOCKET");
    Some(command)
}

pub(crate) fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

pub(crate) fn output(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}\n{text}\n{errors}");
    text
}

fn with_mode(mode: AdapterMode) -> Bench {
    Bench::new(Options {
        mode,
        ..Options::default()
    })
}

/// The real smbus2's output in this mode, recorded on the emulated /dev/i2c-N.
fn recorded(mode: AdapterMode) -> PathBuf {
    folder("tests/socket/smbus2").join(format!("{mode}.txt"))
}

#[test]
fn each_method_gives_what_smbus2_gives() {
    for mode in AdapterMode::ALL {
        let Some(mut python) = python() else { return };
        let bench = with_mode(mode);
        let ours = output(
            python
                .arg(folder("tests/socket/methods.py"))
                .args(["grideye_i2c", "7"])
                .arg(&bench.path),
        );
        let real = fs::read_to_string(recorded(mode)).unwrap();
        for (ours, real) in ours.lines().zip(real.lines()) {
            assert_eq!(ours, real, "{mode}");
        }
        assert_eq!(ours.lines().count(), real.lines().count(), "{mode}");
    }
}

/// GRIDEYE_RECORD=1 records the outputs again.
#[test]
fn the_recorded_outputs_are_those_of_smbus2() {
    if excused("GRIDEYE_WITHOUT_PYTHON_DRIVERS") {
        return skip::test("smbus2 from PyPI on the emulated /dev/i2c-N");
    }
    let python = python_with_smbus2();
    for mode in AdapterMode::ALL {
        let output = on_a_device(&python, mode);
        if excused("GRIDEYE_RECORD") {
            fs::write(recorded(mode), &output).unwrap();
        }
        let expected = fs::read_to_string(recorded(mode)).unwrap();
        assert_eq!(output, expected, "{mode}");
    }
}

/// The output of `methods.py` with the real smbus2 and an emulated /dev/i2c-N.
fn on_a_device(python: &Path, mode: AdapterMode) -> String {
    let number = 100_000 + std::process::id() % 100_000;
    let options = program::Options {
        mode,
        ..program::Options::default()
    };
    let mut rack = Rack::new();
    rack.insert(
        number,
        SharedAdapter::new(RegisterFile::new(Log::default())),
    );
    let file = tempfile::NamedTempFile::new().unwrap();
    let mut command = Command::new(python);
    command
        .arg(folder("tests/socket/methods.py"))
        .args(["smbus2", &number.to_string()])
        .stdout(file.reopen().unwrap())
        .stderr(file.reopen().unwrap());
    let status = program::run(&rack, &options, &mut command).unwrap().status;
    let text = fs::read_to_string(file.path()).unwrap();
    assert!(status.success(), "{text}");
    text
}

/// A Python with smbus2 from PyPI, in its own environment beside the build.
fn python_with_smbus2() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("smbus2");
    let python = folder.join("bin/python3");
    let works = || {
        let script = format!("import smbus2; assert 'smbus2==' + smbus2.__version__ == '{SMBUS2}'");
        Command::new(&python)
            .args(["-c", &script])
            .output()
            .is_ok_and(|output| output.status.success())
    };
    if !works() {
        let made = Command::new("python3")
            .args(["-m", "venv", "--clear"])
            .arg(&folder)
            .output();
        let installed = Command::new(&python)
            .args(["-m", "pip", "install", "--quiet", SMBUS2])
            .output();
        assert!(
            works(),
            "{SMBUS2} cannot be installed: {made:?} {installed:?}\n\
             set GRIDEYE_WITHOUT_PYTHON_DRIVERS=1 to leave this test out"
        );
    }
    python
}

#[test]
fn each_method_of_busio_does_what_circuitpython_says() {
    let Some(mut python) = python() else { return };
    let bench = Bench::new(Options::default());
    let text = output(
        python
            .arg(folder("tests/socket/circuitpython.py"))
            .arg(&bench.path),
    );
    assert_eq!(text, "done\n");
    let last = bench.transfers().last().cloned();
    assert_eq!(last.as_deref(), Some("69R1"));
}

#[test]
fn an_unmodified_program_finds_smbus2_busio_and_board() {
    let Some(mut python) = python() else { return };
    let bench = Bench::new(Options::default());
    let text = output(
        python
            .arg(folder("python/grideye_i2c.py"))
            .arg(&bench.path)
            .arg(folder("tests/socket/unmodified.py"))
            .arg("128")
            .env_remove("PYTHONPATH"),
    );
    // 0x80 * 7 + 3 = 899, and 899 modulo 256 is 131.
    assert_eq!(text, "131\n[131, 138]\n138 [105] __main__\n");
}

#[test]
fn an_import_line_is_enough_to_replace_smbus2() {
    let Some(mut python) = python() else { return };
    let bench = Bench::new(Options::default());
    let script = format!(
        "import grideye_i2c; grideye_i2c.install({:?})\n\
         from smbus2 import SMBus\n\
         print(SMBus(1).read_i2c_block_data(0x69, register=0x80, length=2))",
        bench.path.display().to_string()
    );
    assert_eq!(output(python.args(["-c", &script])), "[131, 138]\n");
}

#[test]
fn every_error_around_the_bus_has_a_number() {
    let Some(mut python) = python() else { return };
    let mut bench = Bench::new(Options::default());
    let mut child = python
        .arg(folder("tests/socket/errors.py"))
        .arg(&bench.path)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert_eq!(lines.next().unwrap().unwrap(), "stop");
    bench.end();
    child.stdin.take().unwrap().write_all(b"go on\n").unwrap();
    assert_eq!(lines.next().unwrap().unwrap(), "done");
    assert!(child.wait().unwrap().success());
}

/// Servers that do not speak the protocol, or are of another release.
#[test]
fn a_server_of_another_protocol_is_named() {
    let Some(mut python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.sock");
    let listener = std::os::unix::net::UnixListener::bind(&path).unwrap();
    let answers: [&[u8]; 5] = [
        b"",
        b"HTTP/1.1 400 Bad Request\r\n\r\n",
        b"\x05\0\0\0\x85\x02old",
        b"\x02\0\0\0\x82\0",
        b"\x05\0\0\0\x81nope",
    ];
    let serving = std::thread::spawn(move || {
        for answer in answers {
            let (mut stream, _) = listener.accept().unwrap();
            // A connection closed with unread bytes would be reset.
            stream.read_exact(&mut [0; 11]).unwrap();
            stream.write_all(answer).unwrap();
        }
    });
    let script = format!(
        "import grideye_i2c\n\
         for _ in range(5):\n\
         \x20   try: grideye_i2c.SMBus(1, socket={:?})\n\
         \x20   except OSError as error: print(error.errno, error.strerror)",
        path.display().to_string()
    );
    let text = output(python.args(["-c", &script]));
    serving.join().unwrap();
    let expected = [
        "107 the server went away: it closed the connection",
        "107 the server went away: it announced a packet of 1347703880 bytes",
        "107 the server went away: old",
        "107 the server went away: it does not speak the protocol of i2c-emulation",
        "107 the server went away: it does not speak the protocol of i2c-emulation",
    ];
    assert_eq!(text.lines().collect::<Vec<_>>(), expected);
}

#[test]
fn an_answer_that_does_not_come_is_a_timeout() {
    let Some(mut python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mute.sock");
    let _listener = std::os::unix::net::UnixListener::bind(&path).unwrap();
    let script = format!(
        "import grideye_i2c; grideye_i2c.TIMEOUT_SECONDS = 0.02\n\
         try: grideye_i2c.SMBus(1, socket={:?})\n\
         except TimeoutError as error: print(error)",
        path.display().to_string()
    );
    let expected = format!(
        "[Errno 110] no answer within 0.02 s: '{}'\n",
        path.display()
    );
    assert_eq!(output(python.args(["-c", &script])), expected);
}

/// The oldest Python version that the file promises to support.
#[test]
fn the_file_is_python_3_7() {
    let Some(mut python) = python() else { return };
    let script = "import ast, sys\n\
         limit = {'feature_version': (3, 7)} if sys.version_info >= (3, 8) else {}\n\
         ast.parse(open(sys.argv[1]).read(), **limit)\n\
         print('read')";
    let text = output(
        python
            .args(["-c", script])
            .arg(folder("python/grideye_i2c.py")),
    );
    assert_eq!(text, "read\n");
}

#[test]
fn the_client_in_the_document_reads_a_frame() {
    let Some(mut python) = python() else { return };
    let bench = Bench::new(Options::default());
    let document = include_str!("../../src/socket/PROTOCOL.md");
    let script = crate::readme::block(document, "python")
        .replace("/tmp/grideye.sock", &bench.path.display().to_string());
    let text = output(python.args(["-c", &script]).env_remove("PYTHONPATH"));
    assert!(text.starts_with("0x82 838a9198"), "{text}");
    assert_eq!(text.trim_end().len(), 5 + 256);
    assert_eq!(bench.transfers(), ["69W[80] 69R128"]);
}
