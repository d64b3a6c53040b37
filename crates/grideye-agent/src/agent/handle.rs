//! A running agent: its state, how to stop it, and its final summary.

use super::threads::Running;
use crate::health::{Health, Identity};
use crate::queue::Shared;
use grideye_recording::wire::Account;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// How long [`AgentHandle::stop`] waits for the bus threads before it abandons one stuck in a transfer.
pub const BUS_STOP_MAX: Duration = Duration::from_secs(3);
/// How much longer than its flush time [`AgentHandle::stop`] waits for the uploader before it abandons a stuck post.
pub const UPLOAD_STOP_MAX: Duration = Duration::from_secs(1);
/// How long [`AgentHandle::stop`] waits for the spooler to write the rest of memory to the disk.
pub const SPOOLER_STOP_MAX: Duration = Duration::from_secs(5);

/// A running agent. Dropping it stops the reading without waiting and without delivering the rest.
#[derive(Debug)]
pub struct AgentHandle {
    pub(super) shared: Arc<Shared>,
    pub(super) running: Arc<Running>,
    pub(super) uploading: Arc<Running>,
    pub(super) spooling: Arc<Running>,
    pub(super) bus_names: Vec<String>,
    pub(super) identity: Identity,
}

impl AgentHandle {
    /// The agent's health.
    #[must_use]
    pub fn health(&self) -> Health {
        Health::new(Arc::clone(&self.shared), self.identity.clone())
    }

    /// Every sensor's current account.
    #[must_use]
    pub fn accounts(&self) -> BTreeMap<String, Account> {
        self.shared.with_ring(|ring| ring.accounts())
    }

    /// Records not yet acknowledged, all sensors together.
    #[must_use]
    pub fn held(&self) -> usize {
        self.shared.with_ring(|ring| ring.len())
    }

    /// Whether every sensor has reached its frame limit.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.running.wait(Duration::ZERO)
    }

    /// Waits for [`AgentHandle::is_finished`], at most this long. Returns whether it is.
    #[must_use]
    pub fn wait_finished(&self, timeout: Duration) -> bool {
        self.running.wait(timeout)
    }

    /// Stops reading, delivers the rest for at most `flush_for`, and returns the summary.
    #[must_use]
    pub fn stop(self, flush_for: Duration) -> Summary {
        self.running.is_stopping.store(true, Ordering::SeqCst);
        self.running.wait(BUS_STOP_MAX);
        self.shared.flush_until(Instant::now() + flush_for);
        // Not waited for: an uploader that panicked leaves the rest in the ring, as the summary shows; so does a post
        // that began before the stop and hangs, which may last as long as a request may.
        self.uploading.wait(flush_for + UPLOAD_STOP_MAX);
        self.shared.end_spooler();
        self.spooling.wait(SPOOLER_STOP_MAX);
        let spool = self.shared.spool_if_free();
        let on_disk =
            spool.and_then(|spool| Some(spool.as_ref()?.waiting_by_sensor(&self.identity.boot)));
        let on_disk = on_disk.unwrap_or_default();
        let sensors = self.shared.with_ring(|ring| {
            let named = |(sensor, account): (String, Account)| {
                let summary = SensorSummary {
                    account,
                    acknowledged: ring.acknowledged(&sensor),
                    on_disk: on_disk.get(&sensor).copied().unwrap_or(0),
                };
                (sensor, summary)
            };
            ring.accounts().into_iter().map(named).collect()
        });
        Summary {
            sensors,
            hung_buses: self.running.still_running(&self.bus_names),
        }
    }
}

impl Drop for AgentHandle {
    fn drop(&mut self) {
        self.running.is_stopping.store(true, Ordering::SeqCst);
        self.shared.flush_until(Instant::now());
        self.shared.end_spooler();
    }
}

/// An agent's final summary, by sensor.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Summary {
    /// Each sensor by name.
    pub sensors: BTreeMap<String, SensorSummary>,
    /// Buses with an abandoned thread, stuck in a transfer.
    pub hung_buses: Vec<String>,
}

/// The outcome of one sensor's frames.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SensorSummary {
    /// The agent's account.
    pub account: Account,
    /// Frames read and acknowledged.
    pub acknowledged: u64,
    /// Frames read that wait in the spool for the next start.
    pub on_disk: u64,
}

impl Summary {
    /// Whether every frame of every sensor was read and is on disk, at the collector or in the spool.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let is_complete = |sensor: &SensorSummary| {
            let account = &sensor.account;
            account.missing == 0 && account.dropped.is_empty() && account.spooled == sensor.on_disk
        };
        self.hung_buses.is_empty() && self.sensors.values().all(is_complete)
    }
}

impl fmt::Display for Summary {
    /// One line per sensor: `i2c-1:0x69: 100 read = 98 stored + 2 dropped + 0 lost; 1 missing`, with `+ 5 on disk` before
    /// the semicolon if the spool holds some. Lost is what ends with the agent: in memory, and not acknowledged.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (name, sensor)) in self.sensors.iter().enumerate() {
            let account = &sensor.account;
            let dropped: u64 = account.dropped.values().sum();
            let line_break = if index == 0 { "" } else { "\n" };
            let (read, stored, on_disk) = (account.read, sensor.acknowledged, sensor.on_disk);
            let lost = account.spooled.saturating_sub(on_disk);
            write!(
                formatter,
                "{line_break}{name}: {read} read = {stored} stored + {dropped} dropped + {lost} lost"
            )?;
            if on_disk > 0 {
                write!(formatter, " + {on_disk} on disk")?;
            }
            write!(formatter, "; {} missing", account.missing)?;
        }
        for bus in &self.hung_buses {
            write!(formatter, "\n{bus}: stuck in a transfer")?;
        }
        Ok(())
    }
}
