//! Ended boots that are not yet fully reported to the collector.

use super::index::Spool;
use super::state::{Count, Run};
use crate::batch::Batch;
use grideye_recording::StreamId;
use grideye_recording::wire::Account;
use std::collections::BTreeMap;
use std::sync::Arc;

impl Spool {
    /// The accounts of an ended boot, by sensor; `None` for the current one.
    #[must_use]
    pub fn ended_accounts(&self, boot: &str) -> Option<BTreeMap<String, Account>> {
        let run = self.runs.iter().find(|run| run.boot == boot)?;
        let waiting = self.waiting_by_sensor(boot);
        let account = |(sensor, count): (&String, &Count)| {
            let frames = waiting.get(sensor).copied().unwrap_or(0);
            (sensor.clone(), count.of_ended(frames))
        };
        Some(run.sensors.iter().map(account).collect())
    }

    /// An empty batch for an ended boot with nothing on disk that is not yet reported.
    #[must_use]
    pub fn ended_run(&self) -> Option<Batch> {
        if !self.unread.is_empty() {
            return None;
        }
        let is_to_tell =
            |run: &&Run| !self.held.contains(&run.boot) && !self.holds_any_of(&run.boot);
        let run = self.runs.iter().find(is_to_tell)?;
        Some(Batch::of_backlog(&run.device, &run.boot, Vec::new()))
    }

    /// Stops sending records of an ended boot until [`Spool::try_held`]; later boots go on. Returns how many of its
    /// frames wait.
    pub fn hold(&mut self, boot: &str) -> u64 {
        self.held.insert(boot.to_owned());
        self.waiting_by_sensor(boot).values().sum()
    }

    /// Releases all held boots. Returns whether there were any.
    pub fn try_held(&mut self) -> bool {
        !std::mem::take(&mut self.held).is_empty()
    }

    /// Forgets a boot, because the collector knows that it ended.
    pub fn told(&mut self, boot: &str) {
        self.runs.retain(|run| run.boot != boot);
    }

    /// Takes the current boot's counts.
    pub(super) fn renew_own_run(&mut self, accounts: &[(Arc<StreamId>, Account)]) {
        for (id, account) in accounts {
            if let Some(count) = self.own_run.sensors.get_mut(&id.sensor) {
                count.renew(account);
            }
        }
    }

    /// The counts of an ended boot; those of the current one are in the ring.
    pub(super) fn run_of(&mut self, id: &StreamId) -> Option<&mut Count> {
        let run = self.runs.iter_mut().find(|run| run.boot == id.boot)?;
        run.sensors.get_mut(&id.sensor)
    }

    fn holds_any_of(&self, boot: &str) -> bool {
        let mut segments = self.segments.values();
        segments.any(|segment| segment.waiting.keys().any(|id| id.boot == boot))
    }

    /// Acknowledging a boot's last records also acknowledges its end.
    pub(super) fn forget_told_run(&mut self, boot: &str) {
        if !self.holds_any_of(boot) {
            self.told(boot);
        }
    }
}
