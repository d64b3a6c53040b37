//! What the agent's threads note of their work. Each note is short and waits for no disk and no network.

use crate::lock::lock;
use grideye_frame::{NoData, Reading};
use grideye_recording::{ClockState, Record};
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

/// Notes of all threads. Times are those of [`Shared::now`](super::Shared::now).
#[derive(Debug, Default)]
pub struct Observed {
    notes: Mutex<Notes>,
}

#[derive(Debug, Default)]
struct Notes {
    delivery: Delivery,
    seen: BTreeMap<usize, Seen>,
    spool: Option<(u64, u64)>,
}

/// How delivery goes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Delivery {
    /// Posts that the collector took.
    pub posts_accepted: u64,
    /// Posts that it did not take, for whatever reason.
    pub posts_failed: u64,
    /// Of those, since the last that it took.
    pub failures_in_a_row: u64,
    /// When it last took one.
    pub last_accepted: Option<Duration>,
    /// Why the last one failed; nothing once one was taken after it.
    pub last_failure: Option<String>,
}

/// The newest record of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seen {
    /// Its number.
    pub seq: u64,
    /// When the newest record that has pixels was handed on; the start of the agent where there was none.
    pub frame_at: Duration,
    /// What was known of the wall clock.
    pub clock: ClockState,
    /// Why it has no pixels, if it has none.
    pub missing: Option<NoData>,
}

impl Observed {
    /// A post was taken.
    pub fn accepted(&self, now: Duration) {
        let delivery = &mut self.notes().delivery;
        delivery.posts_accepted += 1;
        delivery.failures_in_a_row = 0;
        delivery.last_accepted = Some(now);
        delivery.last_failure = None;
    }

    /// A post was not taken.
    pub fn failed(&self, why: &str) {
        let delivery = &mut self.notes().delivery;
        delivery.posts_failed += 1;
        delivery.failures_in_a_row += 1;
        delivery.last_failure = Some(why.to_owned());
    }

    /// A bus thread handed on a record.
    pub fn saw(&self, stream: usize, record: &Record, now: Duration) {
        let mut notes = self.notes();
        let before = notes.seen.get(&stream).map(|seen| seen.frame_at);
        let (frame_at, missing) = match &record.reading {
            Reading::Frame(_) => (now, None),
            Reading::NoData(reason) => (before.unwrap_or(Duration::ZERO), Some(*reason)),
        };
        let seen = Seen {
            seq: record.seq,
            frame_at,
            clock: record.stamp.clock,
            missing,
        };
        notes.seen.insert(stream, seen);
    }

    /// Bytes and frames of the spool, whenever somebody could look.
    pub fn spool(&self, size: Option<(u64, u64)>) {
        self.notes().spool = size;
    }

    /// How delivery goes.
    #[must_use]
    pub fn delivery(&self) -> Delivery {
        self.notes().delivery.clone()
    }

    /// The newest record of a stream.
    #[must_use]
    pub fn seen(&self, stream: usize) -> Option<Seen> {
        self.notes().seen.get(&stream).copied()
    }

    /// Bytes and frames of the spool when somebody could last look.
    #[must_use]
    pub fn last_spool(&self) -> Option<(u64, u64)> {
        self.notes().spool
    }

    fn notes(&self) -> MutexGuard<'_, Notes> {
        lock(&self.notes)
    }
}
