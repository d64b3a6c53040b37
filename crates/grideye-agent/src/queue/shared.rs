//! What the threads of an agent share: the ring, the spool, and when to end.

use super::observed::Observed;
use super::ring::Ring;
use crate::lock::lock;
use crate::spool::Spool;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The ring and the spool between bus threads, spooler and uploader.
///
/// Whoever needs both takes the spool first.
#[derive(Debug)]
pub struct Shared {
    state: Mutex<State>,
    changed: Condvar,
    spool: Mutex<Option<Spool>>,
    observed: Observed,
    started: Instant,
}

#[derive(Debug)]
struct State {
    ring: Ring,
    flush_until: Option<Instant>,
    is_spooler_ending: bool,
}

/// While an agent is stopping nobody waits longer than this.
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
            observed: Observed::default(),
            started: Instant::now(),
        }
    }

    /// The time since this was made, by a clock that only runs forward.
    #[must_use]
    pub fn now(&self) -> Duration {
        self.started.elapsed()
    }

    /// What the threads note of their work, for those who ask how it goes.
    #[must_use]
    pub const fn observed(&self) -> &Observed {
        &self.observed
    }

    /// Works on the ring. Short: the bus threads wait for it.
    pub fn with_ring<T>(&self, work: impl FnOnce(&mut Ring) -> T) -> T {
        work(&mut self.lock().ring)
    }

    /// The spool. May be held as long as the disk takes.
    pub fn spool(&self) -> MutexGuard<'_, Option<Spool>> {
        lock(&self.spool)
    }

    /// The spool, unless the spooler is at work in it.
    pub fn spool_if_free(&self) -> Option<MutexGuard<'_, Option<Spool>>> {
        match self.spool.try_lock() {
            Ok(spool) => Some(spool),
            Err(std::sync::TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(std::sync::TryLockError::WouldBlock) => None,
        }
    }

    /// Tells the uploader to deliver what is there and to end, at this moment at the latest.
    pub fn flush_until(&self, deadline: Instant) {
        self.lock().flush_until = Some(deadline);
        self.changed.notify_all();
    }

    /// Until when the uploader may deliver, if the agent is stopping.
    pub fn flush_deadline(&self) -> Option<Instant> {
        self.lock().flush_until
    }

    /// Tells the spooler to bring everything to the disk and to end.
    pub fn end_spooler(&self) {
        self.lock().is_spooler_ending = true;
        self.changed.notify_all();
    }

    /// Waits this long, or until the spooler is to end. Returns whether it is.
    pub fn waits_for_spooler(&self, pause: Duration) -> bool {
        let goes_on = |state: &mut State| !state.is_spooler_ending;
        let waited = self
            .changed
            .wait_timeout_while(self.lock(), pause, goes_on)
            .unwrap_or_else(PoisonError::into_inner);
        waited.0.is_spooler_ending
    }

    /// Waits this long, or less if the agent is stopping.
    pub fn wait(&self, pause: Duration) {
        let until = Instant::now() + pause;
        let mut state = self.lock();
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let left = match state.flush_until {
                Some(_) if pause > FLUSH_PAUSE => {
                    left.min(FLUSH_PAUSE.saturating_sub(pause.saturating_sub(left)))
                }
                _ => left,
            };
            if left.is_zero() {
                return;
            }
            state = self
                .changed
                .wait_timeout(state, left)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }
}
