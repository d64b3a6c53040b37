//! The service on a machine with systemd: found, enabled, started.

use anyhow::{Context as _, anyhow};
use std::io::{self, Read as _};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// How long one `systemctl` may take: a restart waits for the old run, which has 20 s to deliver what it holds.
const SYSTEMCTL_TIME_MAX: Duration = Duration::from_secs(60);
/// How soon its end is noticed.
const ENDED_EVERY: Duration = Duration::from_millis(20);
/// Bytes of what it says that are repeated, at most.
const SAID_BYTES_MAX: u64 = 2048;

/// Whether there is a service to start.
pub(super) enum Found {
    /// There is.
    Here(Service),
    /// There is none, or it is not to be started: why, and what to do instead.
    Not(String),
}

/// A unit that systemd has loaded.
#[derive(Debug)]
pub(super) struct Service {
    unit: String,
}

impl Service {
    /// Looks for the unit. `by_hand` is what a person does where there is none.
    pub(super) fn find(unit: &str, by_hand: &str) -> anyhow::Result<Found> {
        let running = match systemctl(&["is-system-running"]) {
            Ok(said) => said.text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error).context("systemctl"),
        };
        // A container, or a machine that systemd did not start.
        if matches!(running.as_str(), "" | "offline" | "unknown") {
            return Ok(Found::Not(format!("no systemd runs here; {by_hand}")));
        }
        let state = systemctl(&["show", "--property=LoadState", "--value", unit])
            .context("systemctl show")?
            .text;
        match state.as_str() {
            "loaded" => Ok(Found::Here(Self {
                unit: unit.to_owned(),
            })),
            "masked" => Err(anyhow!(
                "{unit} is masked: somebody forbade to start it\nhint: sudo systemctl unmask {unit}"
            )),
            "not-found" => Ok(Found::Not(format!(
                "there is no unit {unit} here; install the package, or firmware-config/grideye-agent.service, and paste the line again, or {by_hand}"
            ))),
            other => Err(anyhow!(
                "systemd does not understand the unit {unit} ({other})\nhint: `systemctl status {unit}` says why; firmware-config/grideye-agent.service is the one to install"
            )),
        }
    }

    pub(super) fn unit(&self) -> &str {
        &self.unit
    }

    /// Starts it now and at every boot; one that runs is restarted, to read what was written.
    pub(super) fn start(&self) -> anyhow::Result<()> {
        for verb in ["enable", "restart"] {
            let refused = |what: &str| {
                let unit = &self.unit;
                anyhow!(
                    "systemctl {verb} {unit}: {what}\nhint: run this as root (sudo); `journalctl -u {unit} -n 20` says what the service said"
                )
            };
            let said =
                systemctl(&[verb, &self.unit]).map_err(|error| refused(&error.to_string()))?;
            if !said.is_well {
                return Err(refused(&said.text));
            }
        }
        Ok(())
    }

    /// Whether it has ended, and is not to be started again by itself.
    pub(super) fn has_failed(&self) -> bool {
        systemctl(&["is-active", &self.unit]).is_ok_and(|said| said.text == "failed")
    }
}

/// What `systemctl` said, standard output first, without the white space at its ends.
struct Said {
    is_well: bool,
    text: String,
}

fn systemctl(arguments: &[&str]) -> io::Result<Said> {
    let mut command = Command::new("systemctl");
    command
        .args(["--no-ask-password", "--no-pager"])
        .args(arguments);
    ended(&mut command, SYSTEMCTL_TIME_MAX)
}

/// Runs a program to its end; one that does not end in time is killed.
fn ended(command: &mut Command, time_max: Duration) -> io::Result<Said> {
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    let since = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if since.elapsed() >= time_max {
            child.kill()?;
            child.wait()?;
            let what = format!("did not end within {} s", time_max.as_secs_f32());
            return Err(io::Error::new(io::ErrorKind::TimedOut, what));
        }
        thread::sleep(ENDED_EVERY);
    };
    Ok(Said {
        is_well: status.success(),
        text: said(&mut child),
    })
}

fn said(child: &mut Child) -> String {
    let mut bytes = Vec::new();
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    // What cannot be read is not repeated.
    if let Some(stdout) = stdout {
        let _ = stdout.take(SAID_BYTES_MAX).read_to_end(&mut bytes);
    }
    if let Some(stderr) = stderr {
        let _ = stderr.take(SAID_BYTES_MAX).read_to_end(&mut bytes);
    }
    String::from_utf8_lossy(&bytes).trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_does_not_end_is_killed_at_the_limit_and_said() {
        let started = Instant::now();
        let error = ended(Command::new("sleep").arg("600"), Duration::from_millis(100))
            .err()
            .unwrap();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert_eq!(error.to_string(), "did not end within 0.1 s");
        assert!(started.elapsed() < Duration::from_secs(300));
    }

    #[test]
    fn what_a_program_said_and_how_it_ended_are_told_and_a_missing_one_is_not_found() {
        let mut command = Command::new("sh");
        command.args(["-c", "echo out; echo err >&2; exit 3"]);
        let said = ended(&mut command, SYSTEMCTL_TIME_MAX).unwrap();
        assert_eq!((said.is_well, said.text.as_str()), (false, "out\nerr"));
        let missing = ended(
            &mut Command::new("/nonexistent/systemctl"),
            SYSTEMCTL_TIME_MAX,
        );
        assert_eq!(missing.err().unwrap().kind(), io::ErrorKind::NotFound);
    }
}
