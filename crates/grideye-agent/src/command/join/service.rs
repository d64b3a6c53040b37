//! The systemd service, and waiting for its first frame at the collector.

use crate::command::common::{self, Unanswered};
use anyhow::{Context as _, anyhow, bail};
use grideye_agent::advice;
use grideye_agent::join::{Credentials, Joined};
use grideye_frame::NoData;
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::Read as _;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use std::{io, thread};

/// Time limit of one `systemctl`. A restart waits for the old process, which has 20 s to deliver its records.
const SYSTEMCTL_TIME_MAX: Duration = Duration::from_secs(60);
const ENDED_EVERY: Duration = Duration::from_millis(20);
/// Maximum number of bytes repeated from its output.
const SAID_BYTES_MAX: u64 = 2048;
pub(super) enum Found {
    Here(Service),
    /// There is no service, or it should not start: why, and what to do instead.
    Not(String),
}
#[derive(Debug)]
pub(super) struct Service {
    pub(super) unit: String,
}

impl Service {
    /// Looks for the unit. `by_hand` is the alternative to print if there is none.
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
        let state = systemctl(&["show", "--property=LoadState", "--value", unit]);
        match state.context("systemctl show")?.text.as_str() {
            "loaded" => Ok(Found::Here(Self { unit: unit.into() })),
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

    /// Starts the service now and at every boot; restarts a running one so that it reads the new file.
    pub(super) fn start(&self) -> anyhow::Result<()> {
        let unit = &self.unit;
        for verb in ["enable", "restart"] {
            let what = match systemctl(&[verb, unit]) {
                Ok(said) if said.is_well => continue,
                Ok(said) => said.text,
                Err(error) => error.to_string(),
            };
            bail!(
                "systemctl {verb} {unit}: {what}\nhint: run this as root (sudo); `journalctl -u {unit} -n 20` says what the service said"
            );
        }
        Ok(())
    }

    /// Whether it ended and systemd will not restart it.
    pub(super) fn has_failed(&self) -> bool {
        systemctl(&["is-active", &self.unit]).is_ok_and(|said| said.text == "failed")
    }
}

/// The output of `systemctl`, standard output first, trimmed.
struct Said {
    is_well: bool,
    text: String,
}

fn systemctl(arguments: &[&str]) -> io::Result<Said> {
    let mut command = Command::new("systemctl");
    command.args(["--no-ask-password", "--no-pager"]);
    ended(command.args(arguments), SYSTEMCTL_TIME_MAX)
}

/// Runs a program to its end, or kills it at the time limit.
fn ended(command: &mut Command, time_max: Duration) -> io::Result<Said> {
    let command = command.stdin(Stdio::null()).stdout(Stdio::piped());
    let mut child = command.stderr(Stdio::piped()).spawn()?;
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
    let mut bytes = Vec::new();
    let stdout = child.stdout.map(|out| out.take(SAID_BYTES_MAX));
    let stderr = child.stderr.map(|out| out.take(SAID_BYTES_MAX));
    // Unreadable output is left out.
    let _ = stdout.map(|mut out| out.read_to_end(&mut bytes));
    let _ = stderr.map(|mut out| out.read_to_end(&mut bytes));
    Ok(Said {
        is_well: status.success(),
        text: String::from_utf8_lossy(&bytes).trim().to_owned(),
    })
}

/// How often to ask the collector; the agent posts twice a second.
const ASK_EVERY: Duration = Duration::from_millis(500);

/// How long a sensor may deliver no frame after its agent's first post; set-up takes less.
const SILENT_MAX: Duration = Duration::from_secs(10);

/// Stored frames by sensor and boot.
type Frames = BTreeMap<(String, String), u64>;

/// What the collector had before the service started.
pub(super) struct FirstFrame<'a> {
    collector: &'a str,
    credentials: &'a Credentials,
    device: &'a str,
    before: Frames,
}
#[derive(Debug, PartialEq, Eq)]
enum Look {
    Came(String),
    /// The agent posts, but this sensor delivers no frame, for this reason.
    Missing(String, Option<NoData>),
    Nothing,
}

impl<'a> FirstFrame<'a> {
    /// Asks the collector for its frames now. Without an answer, any frame of the device counts as new.
    pub(super) fn of(joined: &'a Joined, device: &'a str) -> Self {
        let mut first = Self {
            collector: &joined.collector,
            credentials: &joined.credentials,
            device,
            before: Frames::new(),
        };
        if let Ok(Some(state)) = first.ask() {
            first.before = sensors(&state).map(frames).collect();
        }
        first
    }

    /// Asks until a frame came, the service failed, or time is up.
    pub(super) fn wait(&self, service: &Service, limit: Duration) -> anyhow::Result<String> {
        let since = Instant::now();
        let mut silent_since = None;
        loop {
            let looked = self.look();
            let is_silent = matches!(looked, Ok(Look::Missing(..)));
            silent_since = silent_since.or(Some(Instant::now())).filter(|_| is_silent);
            let is_known = silent_since.is_some_and(|since| since.elapsed() >= SILENT_MAX);
            let (device, unit) = (self.device, &service.unit);
            if let Ok(Look::Came(sensor)) = &looked {
                return Ok(format!(
                    "{device}/{sensor} gave one, and the collector has it"
                ));
            }
            if service.has_failed() {
                bail!("the service {unit} has ended\nhint: `journalctl -u {unit} -n 20` says why");
            }
            if is_known || since.elapsed() >= limit {
                return Err(self.in_vain(looked, service, limit));
            }
            thread::sleep(ASK_EVERY);
        }
    }

    fn look(&self) -> anyhow::Result<Look> {
        let state = self.ask()?;
        Ok(state.map_or(Look::Nothing, |state| looked(&state, &self.before)))
    }

    /// The collector's state of the device; `None` if it has not posted yet.
    fn ask(&self) -> anyhow::Result<Option<Value>> {
        let path = format!("/v1/devices/{}", self.device);
        let (status, answer) = common::get(self.collector, self.credentials, &path)?;
        match (status, answer["error"]["code"].as_str()) {
            (200, _) => Ok(Some(answer)),
            (404, Some("no_such_device")) => Ok(None),
            _ => {
                let said = answer["error"]["message"].as_str().unwrap_or_default();
                bail!("{}: answered {status} {said}", self.collector)
            }
        }
    }

    /// The error for a first frame that never came: failure if a sensor delivers none, unanswered if nothing is known.
    fn in_vain(
        &self,
        looked: anyhow::Result<Look>,
        service: &Service,
        limit: Duration,
    ) -> anyhow::Error {
        let (unit, device, limit_s) = (&service.unit, self.device, limit.as_secs());
        let show =
            format!("`sudo systemctl stop {unit}; grideye-agent check` shows what the sensor does");
        match looked {
            Ok(Look::Missing(sensor, reason)) => {
                let (reason, hint) = reason.map_or(("unknown", ""), |reason| {
                    (reason.name(), advice::sensor_hint(reason))
                });
                anyhow!(
                    "the agent delivers, but {device}/{sensor} gives no frame: {reason}\nhint: {hint}; {show}"
                )
            }
            Ok(Look::Came(_) | Look::Nothing) => Unanswered(format!(
                "nothing of {device} came within {limit_s} s\nhint: `journalctl -u {unit} -n 20` says what the agent does; {show}"
            ))
            .into(),
            Err(error) => Unanswered(format!(
                "{error:#}\nhint: the agent may well deliver: look at the collector's page, or at `journalctl -u {unit} -n 20`"
            ))
            .into(),
        }
    }
}

fn looked(state: &Value, before: &Frames) -> Look {
    let mut silent = None;
    for sensor in sensors(state) {
        let (stream, frames) = frames(sensor);
        let had = before.get(&stream);
        let (name, _run) = stream;
        let is_missing = !sensor["missing_now"].is_null();
        if !is_missing && frames > had.copied().unwrap_or(0) {
            return Look::Came(name);
        }
        // Frames missing before the start are not news, and a busy host says nothing about the sensor.
        let reason = reason(sensor);
        let is_of_sensor = is_missing || reason.is_some();
        if is_of_sensor && had.is_none() && reason != Some(NoData::HostStalled) {
            silent = Some((name, reason));
        }
    }
    silent.map_or(Look::Nothing, |(name, reason)| Look::Missing(name, reason))
}
fn sensors(state: &Value) -> impl Iterator<Item = &Value> {
    state["sensors"].as_array().into_iter().flatten()
}

/// Why a sensor delivers no frame now. Before its first frame the number of missing ones is unknown and only faults are
/// counted, so the most frequent one is the reason.
fn reason(sensor: &Value) -> Option<NoData> {
    let faults = sensor["errors"].as_object().into_iter().flatten();
    let known = faults.filter_map(|(kind, count)| Some((count.as_u64()?, kind.parse().ok()?)));
    let most = known.max_by_key(|(count, _)| *count);
    let now = sensor["missing_now"].as_str();
    now.map_or(most.map(|(_, reason)| reason), |now| now.parse().ok())
}

/// A sensor's name and boot, and its stored frames, not counting missing ones.
fn frames(sensor: &Value) -> ((String, String), u64) {
    let text = |key: &str| sensor[key].as_str().unwrap_or_default().to_owned();
    let count = |key: &str| sensor[key].as_u64().unwrap_or(0);
    let stream = (text("sensor"), text("boot"));
    (stream, count("stored").saturating_sub(count("missing")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_program_that_does_not_end_is_killed_at_the_limit_and_reported() {
        let started = Instant::now();
        let limit = Duration::from_millis(100);
        let killed = ended(Command::new("sleep").arg("600"), limit);
        let error = killed.err().unwrap();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert_eq!(error.to_string(), "did not end within 0.1 s");
        assert!(started.elapsed() < Duration::from_secs(300));
    }

    #[test]
    fn output_and_exit_status_are_returned_and_a_missing_program_is_not_found() {
        let mut command = Command::new("sh");
        command.args(["-c", "echo out; echo err >&2; exit 3"]);
        let said = ended(&mut command, SYSTEMCTL_TIME_MAX).unwrap();
        assert_eq!((said.is_well, said.text.as_str()), (false, "out\nerr"));
        let mut missing = Command::new("/nonexistent/systemctl");
        let error = ended(&mut missing, SYSTEMCTL_TIME_MAX).err().unwrap();
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
    }

    fn state(boot: &str, stored: u64, missing: u64, missing_now: Option<&str>) -> Value {
        json!({ "sensors": [{
            "sensor": "i2c-1:0x69", "boot": boot, "stored": stored, "missing": missing, "missing_now": missing_now,
        }] })
    }

    #[test]
    fn only_a_frame_that_was_not_there_before_counts() {
        let old: Frames = sensors(&state("a", 100, 10, None)).map(frames).collect();
        let look = |now: &Value| looked(now, &old);
        let came = || Look::Came("i2c-1:0x69".to_owned());
        let missing = || Look::Missing("i2c-1:0x69".to_owned(), Some(NoData::Nack));
        let (nack, stalled) = (Some("nack"), Some("host-stalled"));
        for (boot, stored, gone, now, expected, what) in [
            ("a", 100, 10, None, Look::Nothing, "what was there"),
            ("a", 120, 30, nack, Look::Nothing, "rows of before"),
            ("b", 1, 0, None, came(), "a frame of a new run"),
            ("a", 101, 10, None, came(), "one frame more"),
            ("b", 5, 5, nack, missing(), "rows of a new run"),
            ("b", 0, 0, None, Look::Nothing, "nothing of a new run"),
            ("b", 5, 5, stalled, Look::Nothing, "it may be well"),
        ] {
            assert_eq!(look(&state(boot, stored, gone, now)), expected, "{what}");
        }
        let mut never = state("b", 0, 0, None);
        never["sensors"][0]["errors"] = json!({ "bus-error": 1, "nack": 7, "reset": 9 });
        assert_eq!(look(&never), missing(), "faults before the first frame");
        assert_eq!(look(&json!({})), Look::Nothing);
    }
}
