//! State shared by an agent's threads: the ring, the spool, notes on their work, and when to end.

use super::ring::{RING_FULL, Ring};
use crate::batch::{Batch, Item};
use crate::lock::lock;
use crate::ranges::Ranges;
use crate::spool::{Dropped, SPOOL_DAMAGED, SPOOL_FULL, Spool};
use grideye_frame::{NoData, Reading};
use grideye_recording::wire::Acknowledgement;
use grideye_recording::{ClockState, Record};
use std::collections::BTreeMap;
use std::io;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};

/// To use ring and spool together, lock the spool first.
#[derive(Debug)]
pub struct Shared {
    state: Mutex<State>,
    changed: Condvar,
    spool: Mutex<Option<Spool>>,
    notes: Mutex<Notes>,
    started: Instant,
}

#[derive(Debug)]
struct State {
    ring: Ring,
    flush_until: Option<Instant>,
    is_spooler_ending: bool,
}
const FLUSH_PAUSE: Duration = Duration::from_millis(100);

impl Shared {
    /// Shares a ring, and a spool if there is one.
    #[must_use]
    pub fn new(ring: Ring, spool: Option<Spool>) -> Self {
        Self {
            state: Mutex::new(State {
                ring,
                flush_until: None,
                is_spooler_ending: false,
            }),
            changed: Condvar::new(),
            spool: Mutex::new(spool),
            notes: Mutex::default(),
            started: Instant::now(),
        }
    }

    /// Time since creation, on a clock that never goes back.
    #[must_use]
    pub fn now(&self) -> Duration {
        self.started.elapsed()
    }

    pub(crate) fn notes(&self) -> MutexGuard<'_, Notes> {
        lock(&self.notes)
    }

    /// Locks the ring for `work`, which must be short because the bus threads wait.
    pub fn with_ring<T>(&self, work: impl FnOnce(&mut Ring) -> T) -> T {
        work(&mut self.lock().ring)
    }

    /// The spool; its lock may last as long as the disk takes.
    pub fn spool(&self) -> MutexGuard<'_, Option<Spool>> {
        lock(&self.spool)
    }

    /// The spool, unless the spooler is using it.
    pub(crate) fn spool_if_free(&self) -> Option<MutexGuard<'_, Option<Spool>>> {
        match self.spool.try_lock() {
            Ok(spool) => Some(spool),
            Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }

    /// Removes posted records wherever they wait: the collector has stored them, or rejected them, which counts under
    /// `reason`. Waits for the spool only if one of them is not in memory.
    pub(crate) fn settle(&self, items: Vec<Item>, reason: Option<&str>) {
        let elsewhere = self.with_ring(|ring| ring.settle(items, reason));
        if elsewhere.is_empty() {
            return;
        }
        if let Some(spool) = self.spool().as_mut() {
            let (here, gone) = spool.release(elsewhere, reason);
            self.with_ring(|ring| {
                ring.settle_from_disk(&here, reason);
                if reason.is_none() {
                    ring.take_back(&gone, &[SPOOL_FULL, SPOOL_DAMAGED, RING_FULL]);
                }
            });
        }
    }

    /// Looks in an answer about a boot for frames that the collector had acknowledged and does not have any more: they are
    /// sent again if they are on the disk, and the others are counted. Returns how many of both.
    pub(crate) fn look_back(
        &self,
        boot: &str,
        is_own: bool,
        answer: &Acknowledgement,
    ) -> Option<(u64, u64)> {
        let of_own = is_own.then(|| self.with_ring(|ring| ring.lost(answer)));
        let is_any = |lost: &Vec<(_, Ranges)>| lost.iter().any(|(_, lost)| !lost.is_empty());
        if of_own.as_ref().is_some_and(|lost| !is_any(lost)) {
            return None;
        }
        let mut spool = self.spool();
        let of_ended = || Some(spool.as_ref()?.lost(boot, answer));
        let lost = of_own.or_else(of_ended).filter(is_any)?;
        let (mut all, mut sent_again) = (0, 0);
        for (id, lost) in &lost {
            let again = spool.as_mut().map(|spool| spool.send_again(id, lost));
            let again = again.unwrap_or(0);
            match spool.as_mut() {
                Some(spool) if !is_own => spool.lose(id, lost, again),
                _ => self.with_ring(|ring| ring.lose(id, lost, again)),
            }
            (all, sent_again) = (all + lost.count(), sent_again + again);
        }
        if let Some(spool) = spool.as_mut() {
            spool.tell_again();
        }
        Some((sent_again, all - sent_again))
    }

    /// The oldest records that only the disk has, all of one boot, at most `records_max`. None while it is in use.
    pub(crate) fn next_on_disk(&self, records_max: usize) -> io::Result<Option<Batch>> {
        let mut spool = self.spool_if_free();
        let Some(spool) = spool.as_deref_mut().and_then(Option::as_mut) else {
            return Ok(None);
        };
        let before = self.with_ring(|ring| {
            spool.settle(ring.take_settled());
            ring.first()
        });
        let batch = spool.next_batch(records_max, before)?;
        Ok(batch.or_else(|| spool.ended_run()))
    }

    /// Brings ring and spool up to date with each other, after these records were written. Returns what was dropped
    /// from the disk since the last call.
    pub(crate) fn reconcile(&self, spool: &mut Spool, written: &[Item]) -> Vec<Dropped> {
        self.with_ring(|ring| {
            ring.written(written);
            spool.settle(ring.take_settled());
            for (sensor, numbers) in ring.numbers() {
                spool.acknowledged(sensor, numbers);
            }
            let dropped = spool.take_dropped();
            dropped
                .iter()
                .for_each(|dropped| ring.dropped_from_disk(dropped));
            ring.deliver_in_order(spool.is_scattered());
            dropped
        })
    }

    /// Tells the uploader to deliver the rest and end by this deadline.
    pub(crate) fn flush_until(&self, deadline: Instant) {
        self.lock().flush_until = Some(deadline);
        self.changed.notify_all();
    }
    pub(crate) fn flush_deadline(&self) -> Option<Instant> {
        self.lock().flush_until
    }

    /// Tells the spooler to write everything to the disk and end.
    pub(crate) fn end_spooler(&self) {
        self.lock().is_spooler_ending = true;
        self.changed.notify_all();
    }

    /// Waits this long, or until the spooler should end. Returns whether it should.
    pub(crate) fn waits_for_spooler(&self, pause: Duration) -> bool {
        let goes_on = |state: &mut State| !state.is_spooler_ending;
        let waited = self.changed.wait_timeout_while(self.lock(), pause, goes_on);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        state.is_spooler_ending
    }

    /// Waits this long, or less if the agent is stopping.
    pub(crate) fn wait(&self, pause: Duration) {
        let began = Instant::now();
        let mut state = self.lock();
        loop {
            let pause = match state.flush_until {
                Some(_) => pause.min(FLUSH_PAUSE),
                None => pause,
            };
            let left = pause.saturating_sub(began.elapsed());
            if left.is_zero() {
                return;
            }
            let waited = self.changed.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }
}

/// Short notes from all threads. Times are [`Shared::now`].
#[derive(Debug, Default)]
pub(crate) struct Notes {
    pub(crate) delivery: Delivery,
    /// By stream.
    pub(crate) seen: BTreeMap<usize, Seen>,
    /// The spool's bytes and frames, when its lock was last free.
    pub(crate) spool: Option<(u64, u64)>,
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Delivery {
    pub(crate) posts_accepted: u64,
    pub(crate) posts_failed: u64,
    pub(crate) failures_in_a_row: u64,
    pub(crate) last_accepted: Option<Duration>,
    /// Why the last post failed; `None` after one is accepted.
    pub(crate) last_failure: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Seen {
    pub(crate) seq: u64,
    /// When the last record with pixels was passed on, or the agent's start if there was none.
    pub(crate) frame_at: Duration,
    pub(crate) clock: ClockState,
    pub(crate) missing: Option<NoData>,
}

impl Notes {
    pub(crate) fn accepted(&mut self, now: Duration) {
        let delivery = &mut self.delivery;
        delivery.posts_accepted += 1;
        delivery.failures_in_a_row = 0;
        delivery.last_accepted = Some(now);
        delivery.last_failure = None;
    }

    pub(crate) fn failed(&mut self, why: &str) {
        let delivery = &mut self.delivery;
        delivery.posts_failed += 1;
        delivery.failures_in_a_row += 1;
        delivery.last_failure = Some(why.to_owned());
    }

    pub(crate) fn saw(&mut self, stream: usize, record: &Record, now: Duration) {
        let before = self.seen.get(&stream).map(|seen| seen.frame_at);
        let (frame_at, missing) = match &record.reading {
            Reading::Frame(_) => (now, None),
            Reading::NoData(reason) => (before.unwrap_or(Duration::ZERO), Some(*reason)),
        };
        let newest = Seen {
            seq: record.seq,
            frame_at,
            clock: record.stamp.clock,
            missing,
        };
        self.seen.insert(stream, newest);
    }
}
