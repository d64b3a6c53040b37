//! Time as the collector sees it: handed in, so that tests can hold it still.

use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Where the collector takes its time from.
pub trait Clock: Send + Sync + 'static {
    /// Wall clock in nanoseconds since 1970-01-01 UTC. Stamped on what arrives; never a key, never an order.
    fn utc_ns(&self) -> i64;

    /// Time since some fixed moment, never going back. Ages are told by it.
    fn monotonic(&self) -> Duration;
}

/// The clocks of the machine.
#[derive(Debug, Clone, Copy)]
pub struct SystemClock {
    started: Instant,
}

impl SystemClock {
    /// Starts counting [`Clock::monotonic`] now.
    #[must_use]
    pub fn new() -> Self {
        Self {
            started: Instant::now(),
        }
    }
}

impl Default for SystemClock {
    fn default() -> Self {
        Self::new()
    }
}

impl Clock for SystemClock {
    fn utc_ns(&self) -> i64 {
        match SystemTime::now().duration_since(UNIX_EPOCH) {
            Ok(since) => i64::try_from(since.as_nanos()).unwrap_or(i64::MAX),
            Err(before) => i64::try_from(before.duration().as_nanos()).map_or(i64::MIN, |ns| -ns),
        }
    }

    fn monotonic(&self) -> Duration {
        self.started.elapsed()
    }
}

const STEP_MIN_NS: u64 = 1_000_000_000;

/// What the clocks part from each other before the new difference is stored: every post reads it, few write it.
const DRIFT_MIN_NS: u64 = 1_000_000;

#[derive(Debug)]
pub(crate) struct WallSteps(AtomicI64);

impl WallSteps {
    pub(crate) fn new(clock: &dyn Clock) -> Self {
        Self(AtomicI64::new(lead(clock.utc_ns(), clock.monotonic())))
    }

    /// By how many nanoseconds the wall clock stepped since it was last looked at; `None` if it did not.
    pub(crate) fn look(&self, utc_ns: i64, monotonic: Duration) -> Option<i64> {
        let lead = lead(utc_ns, monotonic);
        let drift = lead.saturating_sub(self.0.load(Ordering::Relaxed));
        if drift.unsigned_abs() < DRIFT_MIN_NS {
            return None;
        }
        let step = lead.saturating_sub(self.0.swap(lead, Ordering::Relaxed));
        (step.unsigned_abs() >= STEP_MIN_NS).then_some(step)
    }
}

fn lead(utc_ns: i64, monotonic: Duration) -> i64 {
    utc_ns.saturating_sub(i64::try_from(monotonic.as_nanos()).unwrap_or(i64::MAX))
}
