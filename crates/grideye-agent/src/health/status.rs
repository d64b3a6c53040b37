//! How an agent does, told to whoever asks.

use super::look::{Look, SensorLook};
use super::metrics;
use crate::queue::Shared;
use grideye_recording::wire::Account;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::Arc;

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
    pub(super) shared: Arc<Shared>,
    identity: Identity,
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
