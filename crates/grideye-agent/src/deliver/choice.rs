//! What goes next.

use super::limits::{BACKLOG_RECORDS_MAX, BATCH_RECORDS_MAX, HEARTBEAT_EVERY};
use super::post::Post;
use super::scheduler::Scheduler;
use crate::batch::{Batch, Lane};
use std::sync::Arc;
use std::time::Duration;

/// How often the disk is asked for a backlog when there was none.
const LOOK_EVERY: Duration = Duration::from_millis(500);

impl<P: Post> Scheduler<P> {
    pub(super) fn choose(&mut self, now: Duration) -> Option<Batch> {
        if let Some(batch) = self.in_doubt.take() {
            if now >= self.turn_of(batch.lane).due {
                return Some(batch);
            }
            self.in_doubt = Some(batch);
            return None;
        }
        if let Some(piece) = self.pieces.pop_front() {
            return Some(piece);
        }
        if now >= self.live.due {
            let batch = self.live_batch(now);
            if !batch.items.is_empty() || self.is_account_due(now) {
                return Some(batch);
            }
            self.live.due = now + self.pace.post_every;
        }
        if now < self.backlog.due || self.live.failures > 0 {
            return None;
        }
        self.try_held(now);
        let batch = self.backlog_batch(now);
        if batch.is_none() {
            self.backlog.due = now + LOOK_EVERY;
        }
        batch
    }

    pub(super) fn live_batch(&self, now: Duration) -> Batch {
        self.shared
            .with_ring(|ring| ring.batch(Lane::Live, now, BATCH_RECORDS_MAX))
    }

    pub(super) fn of_memory(&self, lane: Lane, now: Duration, records_max: usize) -> Option<Batch> {
        let batch = self
            .shared
            .with_ring(|ring| ring.batch(lane, now, records_max));
        (!batch.items.is_empty()).then_some(batch)
    }

    /// The oldest first: what is on the disk is older than what is in memory.
    fn backlog_batch(&mut self, now: Duration) -> Option<Batch> {
        let shared = Arc::clone(&self.shared);
        if let Some(spool) = shared
            .spool_if_free()
            .as_deref_mut()
            .and_then(Option::as_mut)
        {
            match spool.next_batch(BACKLOG_RECORDS_MAX) {
                Ok(Some(batch)) => return Some(batch),
                Ok(None) => {
                    if let Some(ended) = spool.ended_run() {
                        return Some(ended);
                    }
                }
                Err(error) => {
                    let why = format!("the spool cannot be read: {error}");
                    self.say_failure(Lane::Disk, &why, &why);
                }
            }
        }
        self.of_memory(Lane::Late, now, BACKLOG_RECORDS_MAX)
    }

    fn is_account_due(&self, now: Duration) -> bool {
        self.last_account
            .is_none_or(|at| now >= at + HEARTBEAT_EVERY)
    }
}
