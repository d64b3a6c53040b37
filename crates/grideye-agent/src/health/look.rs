//! One look at everything: the figures that both pages show.

use crate::queue::{Delivery, Seen};
use grideye_frame::NoData;
use grideye_recording::wire::Account;
use serde_json::{Value, json};
use std::time::Duration;

/// A sensor without a frame for so long is a reason to look.
pub const STALE_AFTER: Duration = Duration::from_secs(10);

/// One look at everything.
pub(super) struct Look {
    pub(super) now: Duration,
    pub(super) delivery: Delivery,
    /// Records in memory.
    pub(super) held: usize,
    /// Bytes and frames on the disk, where there is one.
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
