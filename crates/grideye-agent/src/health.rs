//! How the agent does, for supervisors on the same machine: one JSON object, and Prometheus' metrics of the same figures.
//!
//! ```text
//!   GET /health    200 {"status":"ok", ...} or 503 {"status":"degraded","why":["delivery: ...", ...], ...}
//!   GET /metrics   grideye_agent_...
//! ```
//!
//! Nothing in it is secret: the collector's address and names of sensors, no token.

mod metrics;
mod observed;
mod server;

pub use observed::{Delivery, Observed, Seen};
pub use server::{ANSWER_TIME_MAX, REQUEST_BYTES_MAX, REQUEST_TIME_MAX, serve};

use crate::shared::Shared;
use grideye_recording::wire::Account;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// A sensor without a frame for so long is a reason to look.
pub const STALE_AFTER: Duration = Duration::from_secs(10);

/// What does not change while an agent runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// The agent's name.
    pub device: String,
    /// This run of it.
    pub boot: String,
    /// Where it delivers.
    pub collector: String,
    /// `ram`, `outage` or `always`.
    pub spool_mode: &'static str,
    /// The sensors, in the order of their streams.
    pub sensors: Vec<String>,
}

/// Tells how an agent does, for as long as somebody asks. Outlives the agent, which then stands still.
#[derive(Debug, Clone)]
pub struct Health {
    shared: Arc<Shared>,
    identity: Identity,
}

/// One look at everything.
struct Look {
    now: Duration,
    delivery: Delivery,
    /// Records in memory.
    held: usize,
    /// Bytes and frames on the disk, where there is one.
    spool: Option<(u64, u64)>,
    sensors: Vec<SensorLook>,
}

struct SensorLook {
    name: String,
    account: Account,
    acknowledged: u64,
    seen: Option<Seen>,
}

impl Health {
    /// Of what these threads share.
    #[must_use]
    pub fn new(shared: Arc<Shared>, identity: Identity) -> Self {
        Self { shared, identity }
    }

    /// What is wrong now, each in one line; nothing where all is well.
    #[must_use]
    pub fn faults(&self) -> Vec<String> {
        self.look().faults()
    }

    /// Everything, as one object with `status` first: `ok` where there is no fault.
    #[must_use]
    pub fn to_json(&self) -> Value {
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
    #[must_use]
    pub fn to_prometheus(&self) -> String {
        let look = self.look();
        metrics::page(&look)
    }

    fn look(&self) -> Look {
        let observed = self.shared.observed();
        // A spool that is at work, or whose disk hangs, is not waited for.
        if let Some(spool) = self.shared.spool_if_free() {
            let spool = spool.as_ref();
            observed.spool(spool.map(|spool| (spool.bytes(), spool.waiting_frames().0)));
        }
        let (held, accounts, acknowledged) = self.shared.with_ring(|ring| {
            let names = self.identity.sensors.iter();
            let acknowledged: Vec<u64> = names.map(|name| ring.acknowledged(name)).collect();
            (ring.len(), ring.accounts(), acknowledged)
        });
        Look {
            now: self.shared.now(),
            delivery: observed.delivery(),
            held,
            spool: observed.last_spool(),
            sensors: self.sensors(accounts, acknowledged),
        }
    }

    fn sensors(
        &self,
        mut accounts: BTreeMap<String, Account>,
        acknowledged: Vec<u64>,
    ) -> Vec<SensorLook> {
        let names = self.identity.sensors.iter().enumerate();
        names
            .zip(acknowledged)
            .map(|((stream, name), acknowledged)| SensorLook {
                name: name.clone(),
                account: accounts.remove(name).unwrap_or_default(),
                acknowledged,
                seen: self.shared.observed().seen(stream),
            })
            .collect()
    }
}

impl Look {
    fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        for sensor in &self.sensors {
            let since = sensor.seen.map_or(Duration::ZERO, |seen| seen.frame_at);
            let silent = self.now.saturating_sub(since);
            if silent > STALE_AFTER {
                faults.push(format!(
                    "{}: no frame for {} s",
                    sensor.name,
                    silent.as_secs()
                ));
            }
        }
        if self.delivery.failures_in_a_row > 0 {
            let why = self.delivery.last_failure.as_deref().unwrap_or_default();
            let first_line = why.lines().next().unwrap_or_default();
            faults.push(format!("delivery: {first_line}"));
        }
        faults
    }

    fn since(&self, at: Option<Duration>) -> Option<f64> {
        at.map(|at| self.now.saturating_sub(at).as_secs_f64())
    }
}

impl SensorLook {
    fn json(&self, look: &Look) -> Value {
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
            "missing_now": self.seen.and_then(|seen| seen.missing).map(grideye_frame::NoData::name),
        })
    }
}

#[cfg(test)]
mod tests;
