//! Ended boots: those not yet fully reported to the collector, and the last of the others, in case it loses them again.

use super::index::Spool;
use super::name::name_of;
use super::segment::HEADER_BYTES;
use super::state::{Count, Run};
use super::types::offset;
use crate::batch::Batch;
use crate::ranges::Ranges;
use grideye_recording::StreamId;
use grideye_recording::wire::{Account, Acknowledgement, BOOTS_TOLD_AGAIN, LOST_BY_COLLECTOR};
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
        let is_to_tell = |run: &&Run| {
            !run.is_told && !self.held.contains(&run.boot) && !self.holds_any_of(&run.boot)
        };
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

    /// The collector knows that this boot ended. The last of such boots are kept, so that they can be reported again.
    pub fn told(&mut self, boot: &str) {
        for run in self.runs.iter_mut().filter(|run| run.boot == boot) {
            run.is_told = true;
        }
        let told = self.runs.iter().filter(|run| run.is_told).count();
        let mut surplus = told.saturating_sub(BOOTS_TOLD_AGAIN);
        self.runs.retain(|run| {
            let is_over = run.is_told && surplus > 0;
            surplus -= usize::from(is_over);
            !is_over
        });
    }

    /// The collector lost what it knew, so all boots are reported again.
    pub(crate) fn tell_again(&mut self) {
        for run in &mut self.runs {
            run.is_told = false;
        }
    }

    /// What the collector acknowledged of an ended boot and, by this answer, no longer has.
    pub(crate) fn lost(
        &self,
        boot: &str,
        answer: &Acknowledgement,
    ) -> Vec<(Arc<StreamId>, Ranges)> {
        let runs = self.runs.iter().filter(|run| run.boot == boot);
        let of_run = |run: &Run| {
            let lost = run.sensors.iter().map(|(sensor, count)| {
                let (device, boot) = (run.device.clone(), run.boot.clone());
                let sensor = sensor.clone();
                let lost = count.acknowledged.lost(answer, &sensor);
                (
                    Arc::new(StreamId {
                        device,
                        sensor,
                        boot,
                    }),
                    lost,
                )
            });
            Vec::from_iter(lost)
        };
        runs.flat_map(of_run).collect()
    }

    /// Lets lost frames that are still on the disk wait again. Returns how many.
    pub(crate) fn send_again(&mut self, id: &Arc<StreamId>, lost: &Ranges) -> u64 {
        let mut left = lost.clone();
        for (number, segment) in &mut self.segments {
            let header = offset(HEADER_BYTES);
            let length = usize::try_from(segment.end - header).unwrap_or(0);
            if segment.streams.contains(id) {
                if let Ok(bytes) = self.disk.read(&name_of(*number), header, length) {
                    segment.wait_again(*number, &bytes, id, &mut left);
                }
            }
        }
        lost.count() - left.count()
    }

    /// Counts lost frames of an ended boot, `again` of which wait again.
    pub(crate) fn lose(&mut self, id: &StreamId, lost: &Ranges, again: u64) {
        if let Some(count) = self.run_of(id) {
            count.acknowledged.remove(lost);
            count_lost(&mut count.dropped, lost, again);
        }
    }

    /// Takes what the collector acknowledged of the current boot.
    pub(crate) fn acknowledged(&mut self, sensor: &str, frames: &Ranges) {
        if let Some(count) = self.own_run.sensors.get_mut(sensor) {
            if count.acknowledged != *frames {
                count.acknowledged = frames.clone();
            }
        }
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

/// Frames that the collector lost and the agent no longer has are dropped.
pub(crate) fn count_lost(dropped: &mut BTreeMap<String, u64>, lost: &Ranges, again: u64) {
    let gone = lost.count() - again;
    if gone > 0 {
        *dropped.entry(LOST_BY_COLLECTOR.to_owned()).or_default() += gone;
    }
}
