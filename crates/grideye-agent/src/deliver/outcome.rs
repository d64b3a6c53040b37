//! What becomes of what was sent.

use super::back_off::back_off;
use super::limits::{BACK_OFF_MIN, BATCH_RECORDS_MAX, RETRY_AFTER_MAX};
use super::post::{Post, Posted};
use super::scheduler::Scheduler;
use crate::batch::{Batch, Item, Lane, is_durable};
use crate::spool::{QUARANTINE, SPOOL_FULL};
use grideye_recording::wire::{self, Acknowledgement};
use std::sync::Arc;
use std::time::Duration;

impl<P: Post> Scheduler<P> {
    /// Returns whether the collector took it.
    pub(super) fn send(&mut self, batch: Batch, timeout: Duration) -> bool {
        self.shared.with_ring(|ring| ring.doubt(Some(&batch)));
        let body = self.to_wire(&batch);
        match self.post.post(&body, timeout) {
            Posted::Durable(answer) => self.taken(batch, &answer),
            Posted::Refused { status, said } => {
                self.clear_doubt();
                self.refused(batch, status, &said);
                false
            }
            Posted::Forbidden { status, said } => {
                self.clear_doubt();
                self.pieces.clear();
                self.forbidden(&batch, status, &said);
                false
            }
            Posted::Later {
                why,
                retry_after,
                is_unstored,
            } => {
                let lane = batch.lane;
                if is_unstored {
                    self.clear_doubt();
                    // It is found again where it is held, and so are the parts behind it.
                    self.pieces.clear();
                } else {
                    self.in_doubt = Some(batch);
                }
                self.failed(lane, &why, retry_after, !is_unstored);
                false
            }
        }
    }

    fn to_wire(&self, batch: &Batch) -> wire::Batch {
        let is_own = batch.boot == self.pace.boot;
        let accounts = if is_own {
            Some(self.shared.with_ring(|ring| ring.accounts()))
        } else {
            let spool = self.shared.spool();
            spool
                .as_ref()
                .and_then(|spool| spool.ended_accounts(&batch.boot))
        };
        let mut body = batch.to_wire(&accounts.unwrap_or_default());
        // Of a run that has ended it is not known whether its boot clock is this one.
        body.t_sent_boot_ns = is_own.then(|| (self.now)().1);
        body
    }

    fn taken(&mut self, mut batch: Batch, answer: &Acknowledgement) -> bool {
        let sent = batch.items.len();
        let stored = batch
            .items
            .iter()
            .take_while(|item| is_durable(answer, item))
            .count();
        batch.items.truncate(stored);
        let (lane, boot) = (batch.lane, batch.boot.clone());
        let is_own = boot == self.pace.boot;
        self.settle(batch, sent);
        self.clear_doubt();
        if stored < sent {
            self.pieces.clear();
        }
        if sent > 0 && stored == 0 {
            let why = "the collector answered, but acknowledged nothing of what was sent";
            self.failed(lane, why, None, false);
            return false;
        }
        let now = self.time();
        if is_own {
            self.last_account = Some(now);
        }
        self.recovered(lane);
        self.released(&boot);
        let post_every = self.pace.post_every;
        let backlog_pause = self.backlog_pause(stored);
        self.shared.observed().accepted(now);
        let turn = self.turn(lane);
        turn.failures = 0;
        turn.due = match lane {
            Lane::Live if sent >= BATCH_RECORDS_MAX => now,
            Lane::Live => now + post_every,
            Lane::Late | Lane::Disk => now + backlog_pause,
        };
        true
    }

    /// So long that the backlog does not go faster than it may.
    fn backlog_pause(&self, records: usize) -> Duration {
        let records = u32::try_from(records).unwrap_or(u32::MAX);
        Duration::from_secs(1) * records / self.pace.backlog_per_s.max(1)
    }

    fn settle(&mut self, batch: Batch, sent: usize) {
        let is_own = batch.boot == self.pace.boot;
        match batch.lane {
            Lane::Live | Lane::Late => {
                self.shared.with_ring(|ring| ring.acknowledge(&batch.items));
            }
            Lane::Disk => {
                let shared = Arc::clone(&self.shared);
                let mut spool = shared.spool();
                let Some(spool) = spool.as_mut() else { return };
                if sent == 0 {
                    spool.told(&batch.boot);
                }
                let (delivered, returned) = spool.release(batch.items);
                if is_own {
                    shared.with_ring(|ring| {
                        ring.delivered_from_disk(&delivered);
                        ring.take_back(&returned, SPOOL_FULL);
                    });
                }
            }
        }
    }

    /// Halves a refused batch until the record that is refused stands alone, and sets that aside.
    fn refused(&mut self, batch: Batch, status: u16, said: &str) {
        let lane = batch.lane;
        match batch.items.as_slice() {
            [] => self.refused_account(&batch, status, said),
            [item] => {
                let kept = self.drop_refused(lane, item, status);
                self.log.error(format!(
                    "the collector refused a record for ever, status {status}: {said}; set aside{kept}"
                ));
                let now = self.time();
                self.turn(lane).due = now;
            }
            _ => {
                let (first, second) = batch.halves();
                self.pieces.push_front(second);
                self.pieces.push_front(first);
            }
        }
    }

    fn refused_account(&mut self, batch: &Batch, status: u16, said: &str) {
        if batch.boot != self.pace.boot {
            if let Some(spool) = self.shared.spool().as_mut() {
                spool.told(&batch.boot);
            }
        }
        self.failed(batch.lane, &format!("status {status}: {said}"), None, false);
    }

    /// Returns what the log should add.
    fn drop_refused(&mut self, lane: Lane, item: &Item, status: u16) -> String {
        let reason = format!("refused-{status}");
        let shared = Arc::clone(&self.shared);
        let mut spool = shared.spool();
        shared.with_ring(|ring| match lane {
            Lane::Live | Lane::Late => {
                ring.drop_refused(std::slice::from_ref(item), &reason);
            }
            Lane::Disk => ring.refused_from_disk(item, &reason),
        });
        match spool.as_mut().map(|spool| spool.quarantine(item, &reason)) {
            None => String::new(),
            Some(Ok(())) => format!(" in {QUARANTINE}"),
            Some(Err(error)) => format!(", but not kept: {error}"),
        }
    }

    fn clear_doubt(&mut self) {
        self.shared.with_ring(|ring| ring.doubt(None));
    }

    fn recovered(&mut self, lane: Lane) {
        if self.turn(lane).said.take().is_some() {
            let left = self.shared.with_ring(|ring| ring.len());
            self.log
                .info(format!("delivering again; {left} records wait in memory"));
        }
    }

    pub(super) fn failed(
        &mut self,
        lane: Lane,
        why: &str,
        retry_after: Option<Duration>,
        is_for_all: bool,
    ) {
        let held = self.shared.with_ring(|ring| ring.len());
        let collector = &self.pace.collector;
        let line = format!("delivery to {collector} failed, {held} records wait: {why}");
        self.say_failure(lane, why, &line);
        let random = self.next_random();
        let now = self.time();
        self.shared.observed().failed(why);
        let turn = self.turn(lane);
        turn.failures = turn.failures.saturating_add(1);
        let pause = retry_after.map_or_else(
            || back_off(turn.failures, random),
            |asked| asked.clamp(BACK_OFF_MIN, RETRY_AFTER_MAX),
        );
        turn.due = now + pause;
        if is_for_all || retry_after.is_some() {
            self.live.due = self.live.due.max(now + pause);
            self.backlog.due = self.backlog.due.max(now + pause);
        }
    }

    /// Logs a failure, unless it is the one that was last logged for this lane.
    pub(super) fn say_failure(&mut self, lane: Lane, why: &str, line: &str) {
        if self.turn_of(lane).said.as_deref() != Some(why) {
            self.log.warning(line);
            self.turn(lane).said = Some(why.to_owned());
        }
    }

    /// SplitMix64 (Steele, Lea and Flood 2014): the pauses of one run can be had again from its seed.
    fn next_random(&mut self) -> u64 {
        self.random = self.random.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.random;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }
}
