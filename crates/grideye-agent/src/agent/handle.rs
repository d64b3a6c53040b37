//! A running agent: what it does, how it is stopped, and what it did.

use super::threads::Running;
use crate::health::{Health, Identity};
use crate::queue::Shared;
use crate::spool::Spool;
use grideye_recording::wire::Account;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// How long [`AgentHandle::stop`] waits for the bus threads; one that hangs longer in a transfer is left behind.
pub const BUS_STOP_MAX: Duration = Duration::from_secs(3);
/// How long [`AgentHandle::stop`] waits beyond its time for the uploader; one that hangs in a post is left behind.
pub const UPLOAD_STOP_MAX: Duration = Duration::from_secs(1);
/// How long [`AgentHandle::stop`] waits for what is left in memory to be on the disk.
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
    /// How the agent does.
    #[must_use]
    pub fn health(&self) -> Health {
        Health::new(Arc::clone(&self.shared), self.identity.clone())
    }

    /// Every sensor's account as of now.
    #[must_use]
    pub fn accounts(&self) -> BTreeMap<String, Account> {
        self.shared.with_ring(|ring| ring.accounts())
    }

    /// Records that the collector is not yet known to have, of all sensors together.
    #[must_use]
    pub fn held(&self) -> usize {
        self.shared.with_ring(|ring| ring.len())
    }

    /// Whether every sensor has reached its limit of frames.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.running.wait(Duration::ZERO)
    }

    /// Waits until [`AgentHandle::is_finished`], or for this long. Returns which.
    #[must_use]
    pub fn wait_finished(&self, timeout: Duration) -> bool {
        self.running.wait(timeout)
    }

    /// Stops reading, delivers what is left for up to `flush_for`, and says what was done.
    #[must_use]
    pub fn stop(self, flush_for: Duration) -> Summary {
        self.running.is_stopping.store(true, Ordering::SeqCst);
        self.running.wait(BUS_STOP_MAX);
        self.shared.flush_until(Instant::now() + flush_for);
        // A panic of the uploader leaves the rest in the ring, which the summary shows; so does a post that began before
        // the stop and hangs: it may last as long as a request may, and is not waited for.
        self.uploading.wait(flush_for + UPLOAD_STOP_MAX);
        self.shared.end_spooler();
        self.spooling.wait(SPOOLER_STOP_MAX);
        let spool = self.shared.spool_if_free();
        let on_disk = spool.and_then(|spool| spool.as_ref().map(Spool::waiting_by_sensor));
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

/// What an agent did, by sensor.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Summary {
    /// The account of each sensor, by its name.
    pub sensors: BTreeMap<String, SensorSummary>,
    /// Buses whose thread hung in a transfer and was left behind.
    pub hung_buses: Vec<String>,
}

/// What became of one sensor's frames.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SensorSummary {
    /// The agent's account.
    pub account: Account,
    /// Frames read that the collector has on disk.
    pub acknowledged: u64,
    /// Frames read that wait in the spool for the next run.
    pub on_disk: u64,
}

impl Summary {
    /// Whether every frame of every sensor was read and is on a disk, the collector's or the spool's.
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
    /// One line a sensor: `i2c-1:0x69: 100 read = 98 stored + 2 dropped + 0 in memory; 1 missing`, and `+ 5 on disk` in
    /// front of the semicolon where the spool holds some.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (name, sensor)) in self.sensors.iter().enumerate() {
            let account = &sensor.account;
            let dropped: u64 = account.dropped.values().sum();
            let line_break = if index == 0 { "" } else { "\n" };
            let (read, stored, on_disk) = (account.read, sensor.acknowledged, sensor.on_disk);
            let in_memory = account.spooled.saturating_sub(on_disk);
            write!(
                formatter,
                "{line_break}{name}: {read} read = {stored} stored + {dropped} dropped + {in_memory} in memory"
            )?;
            if on_disk > 0 {
                write!(formatter, " + {on_disk} on disk")?;
            }
            write!(formatter, "; {} missing", account.missing)?;
        }
        for bus in &self.hung_buses {
            write!(formatter, "\n{bus}: hung in a transfer")?;
        }
        Ok(())
    }
}
