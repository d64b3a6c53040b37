//! An agent's health as one JSON object and as Prometheus families.

use crate::queue::{Delivery, Seen, Shared};
use grideye_frame::NoData;
use grideye_recording::ClockState;
use grideye_recording::prometheus::Text;
use grideye_recording::wire::Account;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// The facts that are constant while an agent runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Identity {
    pub(crate) device: String,
    pub(crate) boot: String,
    pub(crate) collector: String,
    pub(crate) spool_mode: &'static str,
    /// In stream order.
    pub(crate) sensors: Vec<String>,
}

/// An agent's health on request. It outlives the agent; its figures then stay as they were.
#[derive(Debug, Clone)]
pub struct Health {
    pub(super) shared: Arc<Shared>,
    identity: Identity,
}

impl Health {
    pub(crate) fn new(shared: Arc<Shared>, identity: Identity) -> Self {
        Self { shared, identity }
    }

    /// Everything as one object; `status` comes first and is `ok` if there is no fault.
    pub(crate) fn to_json(&self) -> Value {
        let look = self.look();
        let why = look.faults();
        let delivery = &look.delivery;
        json!({
            "status": if why.is_empty() { "ok" } else { "degraded" },
            "why": why,
            "version": env!("CARGO_PKG_VERSION"),
            "device": self.identity.device,
            "boot": self.identity.boot,
            "uptime_s": look.now.as_secs(),
            "delivery": {
                "collector": self.identity.collector,
                "posts_accepted": delivery.posts_accepted,
                "posts_failed": delivery.posts_failed,
                "failures_in_a_row": delivery.failures_in_a_row,
                "last_accepted_age_s": look.since(delivery.last_accepted),
                "last_failure": delivery.last_failure,
            },
            "records_in_memory": look.held,
            "spool": {
                "mode": self.identity.spool_mode,
                "bytes": look.spool.map(|(bytes, _)| bytes),
                "frames": look.spool.map(|(_, frames)| frames),
            },
            "sensors": look.sensors.iter().map(|sensor| sensor.json(&look)).collect::<Vec<_>>(),
        })
    }

    /// The same in Prometheus' text format.
    pub(crate) fn to_prometheus(&self) -> String {
        page(&self.look())
    }

    fn look(&self) -> Look {
        // Do not wait for a spool that is busy or has a stuck disk.
        let spool = self.shared.spool_if_free().map(|spool| {
            let spool = spool.as_ref();
            spool.map(|spool| (spool.bytes(), spool.waiting_frames().0))
        });
        let mut notes = self.shared.notes();
        notes.spool = spool.unwrap_or(notes.spool);
        let (held, sensors) = self.shared.with_ring(|ring| {
            let mut accounts = ring.accounts();
            let sensor = |(stream, name): (usize, &String)| SensorLook {
                name: name.clone(),
                account: accounts.remove(name).unwrap_or_default(),
                acknowledged: ring.acknowledged(name),
                seen: notes.seen.get(&stream).copied(),
            };
            let names = self.identity.sensors.iter().enumerate();
            (ring.len(), names.map(sensor).collect())
        });
        Look {
            now: self.shared.now(),
            delivery: notes.delivery.clone(),
            held,
            spool: notes.spool,
            sensors,
        }
    }
}

/// A sensor without a frame for this long counts as a fault.
pub const STALE_AFTER: Duration = Duration::from_secs(10);
pub(super) struct Look {
    pub(super) now: Duration,
    pub(super) delivery: Delivery,
    pub(super) held: usize,
    /// Bytes and frames on the disk, if there is a spool.
    pub(super) spool: Option<(u64, u64)>,
    pub(super) sensors: Vec<SensorLook>,
}

pub(super) struct SensorLook {
    pub(super) name: String,
    pub(super) account: Account,
    pub(super) acknowledged: u64,
    pub(super) seen: Option<Seen>,
}

impl Look {
    pub(super) fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        for sensor in &self.sensors {
            let since = sensor.seen.map_or(Duration::ZERO, |seen| seen.frame_at);
            let silent = self.now.saturating_sub(since);
            if silent > STALE_AFTER {
                let (name, silent_s) = (&sensor.name, silent.as_secs());
                faults.push(format!("{name}: no frame for {silent_s} s"));
            }
        }
        if self.delivery.failures_in_a_row > 0 {
            let why = self.delivery.last_failure.as_deref().unwrap_or_default();
            let first_line = why.lines().next().unwrap_or_default();
            faults.push(format!("delivery: {first_line}"));
        }
        faults
    }

    pub(super) fn since(&self, at: Option<Duration>) -> Option<f64> {
        at.map(|at| self.now.saturating_sub(at).as_secs_f64())
    }
}

impl SensorLook {
    pub(super) fn json(&self, look: &Look) -> Value {
        let account = &self.account;
        json!({
            "sensor": self.name,
            "read": account.read,
            "missing": account.missing,
            "stored": self.acknowledged,
            "dropped": account.dropped,
            "spooled": account.spooled,
            "errors": account.errors,
            "frame_age_s": look.since(self.seen.map(|seen| seen.frame_at)),
            "seq": self.seen.map(|seen| seen.seq),
            "clock": self.seen.map(|seen| seen.clock.name()),
            "missing_now": self.seen.and_then(|seen| seen.missing).map(NoData::name),
        })
    }
}

pub(super) fn page(look: &Look) -> String {
    let mut text = Text::new();
    of_the_program(&mut text, look);
    of_the_delivery(&mut text, look);
    of_the_sensors(&mut text, look);
    of_the_newest(&mut text, look);
    text.into_string()
}

fn of_the_program(text: &mut Text, look: &Look) {
    text.gauge("grideye_agent_build_info", "The program's version.");
    text.sample(&[("version", env!("CARGO_PKG_VERSION"))], 1);
    let up = "1 while every sensor gives frames and the collector takes them.";
    text.gauge("grideye_agent_up", up);
    text.sample(&[], u8::from(look.faults().is_empty()));
    text.gauge("grideye_agent_uptime_seconds", "Seconds since the start.");
    text.sample(&[], look.now.as_secs());
    text.gauge("grideye_agent_memory_records", "Records in memory.");
    text.sample(&[], look.held);
    if let Some((bytes, frames)) = look.spool {
        text.gauge("grideye_agent_spool_bytes", "Bytes that the spool takes.");
        text.sample(&[], bytes);
        text.gauge("grideye_agent_spool_frames", "Frames in the spool.");
        text.sample(&[], frames);
    }
}

fn of_the_delivery(text: &mut Text, look: &Look) {
    let delivery = &look.delivery;
    let posts = "Posts to the collector, by outcome.";
    text.counter("grideye_agent_posts_total", posts);
    text.sample(&[("outcome", "accepted")], delivery.posts_accepted);
    text.sample(&[("outcome", "failed")], delivery.posts_failed);
    let failures = "Posts failed since the last accepted one.";
    text.gauge("grideye_agent_post_failures_in_a_row", failures);
    text.sample(&[], delivery.failures_in_a_row);
    if let Some(age_s) = look.since(delivery.last_accepted) {
        let age = "Seconds since a post was accepted.";
        text.gauge("grideye_agent_last_accepted_age_seconds", age);
        text.sample(&[], age_s);
    }
}

fn of_the_sensors(text: &mut Text, look: &Look) {
    text.counter("grideye_agent_sensor_read_total", "Frames read.");
    of_each(text, look, |sensor| sensor.account.read);
    let missing = "Frames missed, each recorded with a reason.";
    text.counter("grideye_agent_sensor_missing_total", missing);
    of_each(text, look, |sensor| sensor.account.missing);
    let stored = "Frames that the collector has on disk.";
    text.counter("grideye_agent_sensor_stored_total", stored);
    of_each(text, look, |sensor| sensor.acknowledged);
    let spooled = "Frames read and not acknowledged.";
    text.gauge("grideye_agent_sensor_spooled", spooled);
    of_each(text, look, |sensor| sensor.account.spooled);
    let dropped = "Frames dropped, by reason.";
    text.counter("grideye_agent_sensor_dropped_total", dropped);
    by_reason(text, look, |sensor| &sensor.account.dropped);
    text.counter("grideye_agent_sensor_errors_total", "Faults, by kind.");
    by_reason(text, look, |sensor| &sensor.account.errors);
}

fn of_each(text: &mut Text, look: &Look, count: impl Fn(&SensorLook) -> u64) {
    for sensor in &look.sensors {
        text.sample(&[("sensor", &sensor.name)], count(sensor));
    }
}

fn by_reason(text: &mut Text, look: &Look, counts: impl Fn(&SensorLook) -> &BTreeMap<String, u64>) {
    for sensor in &look.sensors {
        for (reason, count) in counts(sensor) {
            text.sample(&[("sensor", &sensor.name), ("reason", reason)], count);
        }
    }
}

fn of_the_newest(text: &mut Text, look: &Look) {
    let seen = || {
        let sensors = look.sensors.iter();
        sensors.filter_map(|sensor| Some((sensor.name.as_str(), sensor.seen?)))
    };
    let age = "Seconds since the newest frame was read.";
    text.gauge("grideye_agent_sensor_frame_age_seconds", age);
    for (sensor, seen) in seen() {
        let age = look.now.saturating_sub(seen.frame_at);
        text.sample(&[("sensor", sensor)], age.as_secs_f64());
    }
    let clock = "1 for the state of the wall clock at the newest record.";
    text.gauge("grideye_agent_sensor_clock", clock);
    for (sensor, seen) in seen() {
        for state in ClockState::ALL {
            let labels = [("sensor", sensor), ("state", state.name())];
            text.sample(&labels, u8::from(state == seen.clock));
        }
    }
}
