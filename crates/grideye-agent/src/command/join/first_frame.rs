//! Whether the collector has got a frame of this device since the service was started, asked with the device's own token.

use super::service::Service;
use crate::command::collector;
use crate::command::exit::Unanswered;
use grideye_agent::advice;
use grideye_agent::join::{Credentials, Joined};
use grideye_frame::NoData;
use serde_json::Value;
use std::collections::BTreeMap;
use std::thread;
use std::time::{Duration, Instant};

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
        let (status, answer) = collector::get(self.collector, self.credentials, &path)?;
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
                    (reason.name(), advice::sensor::hint(reason))
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
