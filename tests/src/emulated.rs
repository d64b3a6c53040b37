//! Programs on an emulated sensor that shows known words, by each way to reach it.

use crate::programs::{Ended, grideye, root, run, terminate, wait, wait_for};
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// One frame as the registers hold it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Words {
    /// Pixels 1 to 64, 12 bits each.
    pub pixels: [u16; 64],
    /// The thermistor, 12 bits.
    pub thermistor: u16,
}

/// What a pixel's word means in °C: two's complement, 0.25 °C a step (AMG88 spec §4-11-11).
#[must_use]
pub fn pixel_c(word: u16) -> f64 {
    let signed = i32::from(word & 0x7FF) - i32::from(word & 0x800);
    f64::from(signed) / 4.0
}

/// What the thermistor's word means in °C: sign and magnitude, 0.0625 °C a step (AMG88 spec §4-11-10).
#[must_use]
pub fn thermistor_c(word: u16) -> f64 {
    let magnitude = f64::from(word & 0x7FF) / 16.0;
    if word & 0x800 == 0 {
        magnitude
    } else {
        -magnitude
    }
}

/// Writes a recording of these frames, to be replayed one each sensor period; the last one stays.
///
/// # Panics
/// When it cannot be written.
#[must_use]
pub fn recording(folder: &Path, name: &str, frames: impl IntoIterator<Item = Words>) -> PathBuf {
    let mut text = String::from(
        "device,sensor,boot,seq,t_boot_ns,t_utc_ns,clock,t_arrival_ns,missing,thermistor",
    );
    for pixel in 1..=64 {
        write!(text, ",pixel{pixel}").unwrap();
    }
    text.push('\n');
    for (seq, frame) in frames.into_iter().enumerate() {
        let t_ns = seq * 100_000_000;
        let thermistor = thermistor_c(frame.thermistor);
        write!(
            text,
            "made,by-a-test,b,{seq},{t_ns},{t_ns},synced,,,{thermistor}"
        )
        .unwrap();
        for word in frame.pixels {
            write!(text, ",{}", pixel_c(word)).unwrap();
        }
        text.push('\n');
    }
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

/// Runs a program to its end with the emulated sensor at its `/dev/i2c-1`. What emulates says nothing, so that the output is
/// the program's.
///
/// # Panics
/// When it cannot be started.
#[must_use]
pub fn run_emulated<S: AsRef<OsStr>>(source: &[S], program: &Command) -> Ended {
    let mut command = grideye();
    command.args(["emulate", "--quiet"]).args(source);
    command
        .arg("--")
        .arg(program.get_program())
        .args(program.get_args());
    run(&mut command)
}

/// Runs `python3 SCRIPT ARGUMENTS` as `python3 grideye_i2c.py SOCKET SCRIPT ARGUMENTS`: its bus is a Unix socket, behind the
/// one-file client for Python.
///
/// # Panics
/// When the server does not serve or does not end well.
#[must_use]
pub fn run_behind_socket<S: AsRef<OsStr>>(source: &[S], program: &Command) -> Ended {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("bus");
    let mut server = grideye();
    server.args(["emulate", "--quiet"]).args(source);
    server.arg("--socket").arg(&socket).stdout(Stdio::null());
    let mut server = Server(server.spawn().unwrap());
    wait_for("the socket", || socket.exists().then_some(()));
    let client = root().join("crates/i2c-emulation/python/grideye_i2c.py");
    let ended = run(Command::new(program.get_program())
        .arg(client)
        .arg(&socket)
        .args(program.get_args()));
    terminate(&server.0);
    assert_eq!(wait(&mut server.0), 0, "the end of the server");
    assert!(!socket.exists(), "the server left its socket behind");
    ended
}

/// A server that ends with its test, also with one that fails.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
