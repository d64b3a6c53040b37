//! The service on a machine with systemd, and the first frame of it that the collector has.

use crate::command::common::{self, Unanswered};
use anyhow::{Context as _, anyhow};
use grideye_agent::advice;
use grideye_agent::join::{Credentials, Joined};
use grideye_frame::NoData;
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::Read as _;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use std::{io, thread};

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

/// How often the collector is asked; a post comes twice a second.
const ASK_EVERY: Duration = Duration::from_millis(500);

/// How long a sensor may give no frame, once its agent is heard, before that is told: setting it up takes less.
const SILENT_MAX: Duration = Duration::from_secs(10);

/// Frames that the collector has, by sensor and run.
type Frames = BTreeMap<(String, String), u64>;

/// What the collector had before the service was started.
pub(super) struct FirstFrame<'a> {
    collector: &'a str,
    credentials: &'a Credentials,
    device: &'a str,
    before: Frames,
}

/// What a look at the collector shows.
#[derive(Debug, PartialEq, Eq)]
enum Look {
    /// This sensor's frames came.
    Came(String),
    /// The agent is heard, but this sensor gives no frame, for this reason.
    Missing(String, Option<NoData>),
    /// Nothing came.
    Nothing,
}

impl<'a> FirstFrame<'a> {
    /// Asks what the collector has now. Where it does not say, any frame of the device counts as a new one.
    pub(super) fn of(joined: &'a Joined, device: &'a str) -> Self {
        let mut first = Self {
            collector: &joined.collector,
            credentials: &joined.credentials,
            device,
            before: Frames::new(),
        };
        if let Ok(Some(state)) = first.ask() {
            first.before = sensors(&state).map(|sensor| sensor.frames()).collect();
        }
        first
    }

    /// Asks until a frame came, the service has failed, or the time is over.
    pub(super) fn wait(&self, service: &Service, limit: Duration) -> anyhow::Result<String> {
        let since = Instant::now();
        let mut silent_since = None;
        loop {
            let looked = self.look();
            let is_silent = matches!(looked, Ok(Look::Missing(..)));
            silent_since = silent_since
                .filter(|_| is_silent)
                .or(is_silent.then(Instant::now));
            let is_known = silent_since.is_some_and(|since: Instant| since.elapsed() >= SILENT_MAX);
            if let Ok(Look::Came(sensor)) = &looked {
                return Ok(format!(
                    "{}/{sensor} gave one, and the collector has it",
                    self.device
                ));
            }
            if service.has_failed() {
                anyhow::bail!(
                    "the service {0} has ended\nhint: `journalctl -u {0} -n 20` says why",
                    service.unit()
                );
            }
            if is_known || since.elapsed() >= limit {
                return Err(self.in_vain(looked, service, limit));
            }
            thread::sleep(ASK_EVERY);
        }
    }

    fn look(&self) -> anyhow::Result<Look> {
        Ok(self
            .ask()?
            .map_or(Look::Nothing, |state| looked(&state, &self.before)))
    }

    /// What the collector knows of the device; nothing, where nothing of it came yet.
    fn ask(&self) -> anyhow::Result<Option<Value>> {
        let path = format!("/v1/devices/{}", self.device);
        let (status, answer) = common::get(self.collector, self.credentials, &path)?;
        match (status, answer["error"]["code"].as_str()) {
            (200, _) => Ok(Some(answer)),
            (404, Some("no_such_device")) => Ok(None),
            _ => {
                let said = answer["error"]["message"].as_str().unwrap_or_default();
                anyhow::bail!("{}: answered {status} {said}", self.collector)
            }
        }
    }

    /// A sensor that gives no frame has failed; where nothing is known there is no answer.
    fn in_vain(
        &self,
        looked: anyhow::Result<Look>,
        service: &Service,
        limit: Duration,
    ) -> anyhow::Error {
        let (unit, device, limit_s) = (service.unit(), self.device, limit.as_secs());
        let show =
            format!("`sudo systemctl stop {unit}; grideye-agent check` shows what the sensor does");
        match looked {
            Ok(Look::Missing(sensor, reason)) => {
                let (reason, hint) = reason.map_or(("unknown", ""), |reason| {
                    (reason.name(), advice::sensor_hint(reason))
                });
                anyhow::anyhow!(
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
        let (stream, frames) = sensor.frames();
        let had = before.get(&stream);
        let (name, _run) = stream;
        let is_missing = !sensor.0["missing_now"].is_null();
        if !is_missing && frames > had.copied().unwrap_or(0) {
            return Look::Came(name);
        }
        // What was missing before the start is no news of now, and a busy computer says nothing of the sensor.
        let reason = sensor.reason();
        let is_of_sensor = is_missing || reason.is_some();
        if is_of_sensor && had.is_none() && reason != Some(NoData::HostStalled) {
            silent = Some((name, reason));
        }
    }
    silent.map_or(Look::Nothing, |(name, reason)| Look::Missing(name, reason))
}

/// One sensor of `GET /v1/devices/{device}`.
struct Sensor<'a>(&'a Value);

impl Sensor<'_> {
    /// Why it gives no frame now. Before its first one nobody knows how many are missing: the faults alone are counted, and
    /// the most frequent one tells.
    fn reason(&self) -> Option<NoData> {
        let now = self.0["missing_now"].as_str();
        let faults = self.0["errors"].as_object().into_iter().flatten();
        let most = faults
            .filter_map(|(kind, count)| Some((count.as_u64()?, kind.parse().ok()?)))
            .max_by_key(|(count, _)| *count)
            .map(|(_, reason)| reason);
        now.map_or(most, |missing| missing.parse().ok())
    }

    /// Its name and its run, and how many frames of it are stored; rows without a frame do not count.
    fn frames(&self) -> ((String, String), u64) {
        let text = |key: &str| self.0[key].as_str().unwrap_or_default().to_owned();
        let count = |key: &str| self.0[key].as_u64().unwrap_or(0);
        (
            (text("sensor"), text("boot")),
            count("stored").saturating_sub(count("missing")),
        )
    }
}

fn sensors(state: &Value) -> impl Iterator<Item = Sensor<'_>> {
    state["sensors"]
        .as_array()
        .into_iter()
        .flatten()
        .map(Sensor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

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

    fn state(boot: &str, stored: u64, missing: u64, missing_now: Option<&str>) -> Value {
        json!({ "sensors": [{
            "sensor": "i2c-1:0x69", "boot": boot, "stored": stored, "missing": missing, "missing_now": missing_now,
        }] })
    }

    #[test]
    fn a_frame_counts_that_was_not_there_before() {
        let before = |state: &Value| -> Frames { sensors(state).map(|one| one.frames()).collect() };
        let old = before(&state("a", 100, 10, None));
        let look = |now: &Value| looked(now, &old);
        assert_eq!(look(&state("a", 100, 10, None)), Look::Nothing);
        assert_eq!(
            look(&state("a", 120, 30, Some("nack"))),
            Look::Nothing,
            "rows without a frame, of the run before"
        );
        let came = Look::Came("i2c-1:0x69".to_owned());
        assert_eq!(look(&state("b", 1, 0, None)), came);
        assert_eq!(look(&state("a", 101, 10, None)), came);
        assert_eq!(
            look(&state("b", 5, 5, Some("nack"))),
            Look::Missing("i2c-1:0x69".to_owned(), Some(NoData::Nack))
        );
        assert_eq!(look(&state("b", 0, 0, None)), Look::Nothing);
        let mut never = state("b", 0, 0, None);
        never["sensors"][0]["errors"] = json!({ "bus-error": 1, "nack": 7, "reset": 9 });
        assert_eq!(
            look(&never),
            Look::Missing("i2c-1:0x69".to_owned(), Some(NoData::Nack)),
            "faults alone, before the first frame"
        );
        assert_eq!(
            look(&state("b", 5, 5, Some("host-stalled"))),
            Look::Nothing,
            "the sensor may be well"
        );
        assert_eq!(look(&json!({})), Look::Nothing);
    }
}
