//! What the collector does not let this agent send: of the run that goes on it is tried again, like any failure; what is
//! left of an earlier run is held on the disk, so that it does not keep what stands behind it.

use super::limits::{BACKLOG_FORBIDDEN, HELD_FOR};
use super::post::Post;
use super::scheduler::Scheduler;
use crate::batch::{Batch, Lane};
use crate::queue::Shared;
use crate::spool::RUNS_MAX;
use std::sync::Arc;
use std::time::Duration;

/// Runs of which the log remembers what it has said: as many as a spool remembers.
const SAID_MAX: usize = RUNS_MAX;

impl<P: Post> Scheduler<P> {
    pub(super) fn forbidden(&mut self, batch: &Batch, status: u16, said: &str) {
        if batch.lane != Lane::Disk || batch.boot == self.pace.boot {
            self.failed(batch.lane, &forbids(status, said), None, false);
            return;
        }
        let shared: Arc<Shared> = Arc::clone(&self.shared);
        let frames = shared
            .spool()
            .as_mut()
            .map_or(0, |spool| spool.hold(&batch.boot));
        shared.with_ring(|ring| ring.count_fault_of_all(BACKLOG_FORBIDDEN));
        let now = self.time();
        self.held_until.get_or_insert(now + HELD_FOR);
        self.turn(batch.lane).due = now;
        let why = forbids(status, said);
        if self.held_said.get(&batch.boot) == Some(&why) || self.held_said.len() >= SAID_MAX {
            return;
        }
        let (device, boot) = (&batch.device, &batch.boot);
        self.log.error(format!(
            "{why}; {frames} frames of device {device}, run {boot}, are held in the spool and tried again every {} min; all others go on\n\
             hint: let this agent send as {device} too, or set `device` in its configuration back to that until they have arrived",
            HELD_FOR.as_secs() / 60
        ));
        self.held_said.insert(batch.boot.clone(), why);
    }

    /// Lets what is held be tried again when it is time.
    pub(super) fn try_held(&mut self, now: Duration) {
        if self.held_until.is_some_and(|until| now >= until) {
            self.held_until = None;
            if let Some(spool) = self.shared.spool().as_mut() {
                spool.try_held();
            }
        }
    }

    /// Says that a run that was held is no longer.
    pub(super) fn released(&mut self, boot: &str) {
        if self.held_said.remove(boot).is_some() {
            self.log.info(format!(
                "what is left of run {boot} is being delivered again"
            ));
        }
    }
}

fn forbids(status: u16, said: &str) -> String {
    format!("the collector forbids it, status {status}: {said}")
}
