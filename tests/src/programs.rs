//! The real programs, built once in release mode, started and stopped.

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;

pub use crate::patience::wait_for;
pub use crate::skip::{is_left_out, is_part_left_out};

/// The longest file of a recording: an hour of one sensor has 20 MB.
const RECORDING_BYTES_MAX: u64 = 200 * 1024 * 1024;

/// The repository's root.
#[must_use]
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A command that runs `grideye`, in the repository's root.
#[must_use]
pub fn grideye() -> Command {
    command("grideye")
}

/// A command that runs `grideye-agent`, in the repository's root.
#[must_use]
pub fn grideye_agent() -> Command {
    command("grideye-agent")
}

/// A command that runs `grideye-hardware`, the suite for a real sensor, in the repository's root.
#[must_use]
pub fn grideye_hardware() -> Command {
    command("grideye-hardware")
}

fn command(name: &str) -> Command {
    let mut command = Command::new(folder().join(name));
    command.current_dir(root());
    command
}

/// Where cargo builds.
#[must_use]
pub fn target() -> PathBuf {
    root().join(std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()))
}

/// Where the release programs are: in the folder that `GRIDEYE_PROGRAMS` names, or built here and now.
///
/// # Panics
/// When they do not build.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        if let Some(built) = std::env::var_os("GRIDEYE_PROGRAMS") {
            return built.into();
        }
        let mut cargo = Command::new(env!("CARGO"));
        // What cargo says of this test to itself is no news for a build: `ring` would be built again for it.
        for (name, _) in std::env::vars_os() {
            let is_of_this_test = |start: &&str| name.to_string_lossy().starts_with(*start);
            if ["CARGO_PKG_", "CARGO_MANIFEST_"]
                .iter()
                .any(is_of_this_test)
            {
                cargo.env_remove(&name);
            }
        }
        let build = cargo
            .args([
                "build",
                "--release",
                "--locked",
                "-p",
                "grideye-hil",
                "-p",
                "grideye-agent",
                "-p",
                "grideye-hardware",
                "-p",
                "grideye-python",
            ])
            .current_dir(root())
            .output()
            .unwrap();
        assert!(
            build.status.success(),
            "{}",
            String::from_utf8_lossy(&build.stderr)
        );
        target().join("release")
    })
}

/// What a program printed, as text.
#[derive(Debug)]
pub struct Ended {
    /// Exit code; -1 after a signal.
    pub code: i32,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

/// Runs a command to its end.
///
/// # Panics
/// When it cannot be started.
pub fn run(command: &mut Command) -> Ended {
    let Output {
        status,
        stdout,
        stderr,
    } = command.stdin(Stdio::null()).output().unwrap();
    Ended {
        code: status.code().unwrap_or(-1),
        stdout: String::from_utf8_lossy(&stdout).into_owned(),
        stderr: String::from_utf8_lossy(&stderr).into_owned(),
    }
}

/// A running `grideye collect`; killed when dropped.
#[derive(Debug)]
pub struct RunningCollector {
    child: Child,
    url: String,
}

impl RunningCollector {
    /// Starts a collector on a free loopback port, with its store in `folder`.
    ///
    /// # Panics
    /// When it does not say where it listens.
    #[must_use]
    pub fn start(folder: &Path) -> Self {
        Self::start_on(folder.join("store.sqlite"))
    }

    /// Starts a collector on a free loopback port, with its store in this file or at this URL.
    ///
    /// # Panics
    /// When it does not say where it listens.
    #[must_use]
    pub fn start_on(store: impl AsRef<std::ffi::OsStr>) -> Self {
        Self::start_with(store, &[])
    }

    /// The same with more arguments.
    ///
    /// # Panics
    /// When it does not say where it listens.
    #[must_use]
    pub fn start_with(store: impl AsRef<std::ffi::OsStr>, arguments: &[&std::ffi::OsStr]) -> Self {
        let mut child = grideye()
            .args(["collect", "--listen", "127.0.0.1:0", "--store"])
            .arg(store)
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap())
            .read_line(&mut line)
            .unwrap();
        assert!(
            line.starts_with("http://127.0.0.1:"),
            "the collector said {line:?}"
        );
        Self {
            child,
            url: line.trim().trim_end_matches('/').to_owned(),
        }
    }

    /// `http://127.0.0.1:PORT`.
    #[must_use]
    pub fn url(&self) -> &str {
        &self.url
    }

    /// The most memory that it ever had resident, in KiB.
    #[must_use]
    pub fn peak_kib(&self) -> u64 {
        peak_kib(self.child.id())
    }

    /// What a GET of `path` answers, as JSON.
    ///
    /// # Panics
    /// When it answers something else.
    #[must_use]
    pub fn json(&self, path: &str) -> serde_json::Value {
        ureq::get(format!("{}{path}", self.url))
            .call()
            .unwrap()
            .body_mut()
            .read_json()
            .unwrap()
    }

    /// Starts a recording of what arrives; its number.
    ///
    /// # Panics
    /// When the collector refuses.
    #[must_use]
    pub fn start_recording(&self, name: &str) -> u64 {
        let recordings = format!("{}/v1/recordings", self.url);
        let mut answer = ureq::post(recordings)
            .send_json(serde_json::json!({ "name": name }))
            .unwrap();
        let recording: serde_json::Value = answer.body_mut().read_json().unwrap();
        recording["id"].as_u64().unwrap()
    }

    /// Ends a recording; its file.
    ///
    /// # Panics
    /// When there is no such recording.
    #[must_use]
    pub fn recording_csv(&self, id: u64) -> String {
        let recording = format!("{}/v1/recordings/{id}", self.url);
        ureq::post(format!("{recording}/stop"))
            .send_empty()
            .unwrap();
        ureq::get(format!("{recording}.csv"))
            .call()
            .unwrap()
            .body_mut()
            .with_config()
            .limit(RECORDING_BYTES_MAX)
            .read_to_string()
            .unwrap()
    }

    /// Ends it at once, in the middle of whatever it does (SIGKILL).
    ///
    /// # Panics
    /// When it is gone already.
    pub fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Its process, for `/proc`.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Asks it to stop, as systemd does, and waits for its end.
    ///
    /// # Panics
    /// When it does not end in time.
    #[must_use]
    pub fn stop(mut self) -> Ended {
        terminate(&self.child);
        let code = wait(&mut self.child);
        let mut stderr = String::new();
        self.child
            .stderr
            .take()
            .unwrap()
            .read_to_string(&mut stderr)
            .unwrap();
        Ended {
            code,
            stdout: String::new(),
            stderr,
        }
    }
}

impl Drop for RunningCollector {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends SIGTERM.
///
/// # Panics
/// When there is no `kill`.
pub fn terminate(child: &Child) {
    assert!(
        Command::new("kill")
            .arg(child.id().to_string())
            .status()
            .unwrap()
            .success()
    );
}

/// Waits for a program's end; its exit code, -1 after a signal.
///
/// # Panics
/// When it does not end in time.
pub fn wait(child: &mut Child) -> i32 {
    wait_for("the program's end", || child.try_wait().unwrap())
        .code()
        .unwrap_or(-1)
}

/// The most memory that a process ever had resident, in KiB (`VmHWM`).
///
/// # Panics
/// When there is no such process.
#[must_use]
pub fn peak_kib(pid: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}
