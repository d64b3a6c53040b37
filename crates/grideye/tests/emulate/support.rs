//! Starting the program, reading the sensor over its socket, and files to show.

use crate::client::Client;
pub(crate) use crate::patience::wait_for;
use embedded_hal::i2c::I2c as _;
use rustix::process::{Pid, Signal, kill_process};
use std::fmt::Write as _;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// The repository's root.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// `grideye emulate` with these arguments, in the repository's root.
pub(crate) fn emulate(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
    command.arg("emulate").args(arguments).current_dir(root());
    command
}

/// What a program printed, and how it ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// -1 after a signal.
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

pub(crate) fn run(command: &mut Command) -> Ended {
    let output = command.stdin(Stdio::null()).output().unwrap();
    Ended {
        code: output.status.code().unwrap_or(-1),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

/// A running `grideye emulate --socket`; killed when dropped.
pub(crate) struct Server {
    child: Child,
    socket: PathBuf,
    // Removed last, with whatever the server has left in it.
    folder: tempfile::TempDir,
}

impl Server {
    /// Starts it, and waits until it says that it is ready.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("amg.sock");
        let mut child = emulate(arguments)
            .arg("--socket")
            .arg(&socket)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap())
            .read_line(&mut line)
            .unwrap();
        if line.trim_end() != socket.to_str().unwrap() && !line.starts_with('{') {
            let mut stderr = String::new();
            child
                .stderr
                .take()
                .unwrap()
                .read_to_string(&mut stderr)
                .unwrap();
            panic!("the server said {line:?} and {stderr:?}");
        }
        Self {
            child,
            socket,
            folder,
        }
    }

    /// Its socket.
    pub(crate) fn socket(&self) -> &Path {
        &self.socket
    }

    /// A connection to one of its buses.
    pub(crate) fn client(&self, bus: u32) -> Client {
        Client::connect(&self.socket, bus).unwrap()
    }

    /// Sends it a signal.
    pub(crate) fn signal(&self, signal: Signal) {
        signal_process(self.child.id(), signal);
    }

    /// Waits for its end; it must have left nothing in the socket's folder.
    pub(crate) fn wait(mut self) -> Ended {
        let code = wait(&mut self.child);
        let mut stderr = String::new();
        self.child
            .stderr
            .take()
            .unwrap()
            .read_to_string(&mut stderr)
            .unwrap();
        let left: Vec<_> = std::fs::read_dir(self.folder.path()).unwrap().collect();
        assert!(left.is_empty(), "left behind: {left:?}");
        Ended {
            code,
            stdout: String::new(),
            stderr,
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The exit code of a program that was asked to end; -1 after a signal.
pub(crate) fn wait(child: &mut Child) -> i32 {
    wait_for("the program's end", || child.try_wait().unwrap())
        .code()
        .unwrap_or(-1)
}

pub(crate) fn signal_process(pid: u32, signal: Signal) {
    let pid = Pid::from_raw(i32::try_from(pid).unwrap()).unwrap();
    kill_process(pid, signal).unwrap();
}

/// The 64 pixels of a sensor, in quarters of a degree (AMG88 spec §4-11-11: 12 bits, two's complement).
pub(crate) fn pixels(client: &mut Client, address: u8) -> Vec<i32> {
    let mut bytes = [0; 128];
    client.write_read(address, &[0x80], &mut bytes).unwrap();
    bytes
        .chunks_exact(2)
        .map(|pair| {
            let word = i32::from(pair[0]) | i32::from(pair[1] & 0x0F) << 8;
            if word >= 0x800 { word - 0x1000 } else { word }
        })
        .collect()
}

/// Writes a recording: `frames` are a time in milliseconds and one temperature for all pixels, °C.
pub(crate) fn recording(folder: &Path, frames: &[(u64, f64)]) -> String {
    let mut text = String::from(
        "device,sensor,boot,seq,t_boot_ns,t_utc_ns,clock,t_arrival_ns,missing,thermistor",
    );
    for pixel in 1..=64 {
        write!(text, ",pixel{pixel}").unwrap();
    }
    text.push('\n');
    for (seq, (t_ms, celsius)) in frames.iter().enumerate() {
        let t_ns = t_ms * 1_000_000 + 5_000_000_000;
        write!(text, "d,s,b,{seq},{t_ns},{t_ns},synced,,,25").unwrap();
        for _ in 0..64 {
            write!(text, ",{celsius}").unwrap();
        }
        text.push('\n');
    }
    file(folder, "recording.csv", &text)
}

/// A file of a test; its path.
pub(crate) fn file(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Two rooms' ends under one roof: `left` has a warm body below it, `right` has none; `wide` is no AMG8833.
pub(crate) const TWO_SENSORS: &str = r#"
[room]
size_mm = [4000, 6000, 2700]
ambient_c = 20

[[object]]
name = "person"
position_mm = [1000, 1000, 0]
size_mm = [600, 600, 1750]
temperature_c = 36

[[sensor]]
name = "left"
preset = "grid-eye"
noise_sigma_c = 0
position_mm = [1000, 1000, 2700]
elevation_deg = 90
azimuth_deg = -90

[[sensor]]
name = "right"
preset = "grid-eye"
noise_sigma_c = 0
position_mm = [3200, 4900, 2700]
elevation_deg = 90
azimuth_deg = -90

[[sensor]]
name = "wide"
preset = "grid-eye"
resolution = [80, 60]
position_mm = [2000, 3000, 2700]
elevation_deg = 90
azimuth_deg = -90
"#;
