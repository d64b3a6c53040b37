//! What goes next.

use super::{BACKLOG_RECORDS_MAX, BATCH_RECORDS_MAX, Courier, HEARTBEAT_EVERY, LOOK_EVERY, Post};
use crate::parcel::{Lane, Parcel};
use std::sync::Arc;
use std::time::Duration;

impl<P: Post> Courier<P> {
    pub(super) fn choose(&mut self, now: Duration) -> Option<Parcel> {
        if let Some(parcel) = self.in_doubt.take() {
            if now >= self.turn_of(parcel.lane).due {
                return Some(parcel);
            }
            self.in_doubt = Some(parcel);
            return None;
        }
        if let Some(piece) = self.pieces.pop_front() {
            return Some(piece);
        }
        if now >= self.live.due {
            let parcel = self.live_parcel(now);
            if !parcel.items.is_empty() || self.is_account_due(now) {
                return Some(parcel);
            }
            self.live.due = now + self.pace.post_every;
        }
        if now < self.backlog.due || self.live.failures > 0 {
            return None;
        }
        self.try_held(now);
        let parcel = self.backlog_parcel(now);
        if parcel.is_none() {
            self.backlog.due = now + LOOK_EVERY;
        }
        parcel
    }

    pub(super) fn live_parcel(&self, now: Duration) -> Parcel {
        self.shared
            .with_ring(|ring| ring.parcel(Lane::Live, now, BATCH_RECORDS_MAX))
    }

    pub(super) fn of_memory(
        &self,
        lane: Lane,
        now: Duration,
        records_max: usize,
    ) -> Option<Parcel> {
        let parcel = self
            .shared
            .with_ring(|ring| ring.parcel(lane, now, records_max));
        (!parcel.items.is_empty()).then_some(parcel)
    }

    /// The oldest first: what is on the disk is older than what is in memory.
    fn backlog_parcel(&mut self, now: Duration) -> Option<Parcel> {
        let shared = Arc::clone(&self.shared);
        if let Some(spool) = shared
            .spool_if_free()
            .as_deref_mut()
            .and_then(Option::as_mut)
        {
            match spool.next_parcel(BACKLOG_RECORDS_MAX) {
                Ok(Some(parcel)) => return Some(parcel),
                Ok(None) => {
                    if let Some(ended) = spool.ended_run() {
                        return Some(ended);
                    }
                }
                Err(error) => {
                    self.say_failure(Lane::Disk, &format!("the spool cannot be read: {error}"));
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
