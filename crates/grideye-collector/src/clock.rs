//! Time as the collector sees it: injected, so that tests can control it.

use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The collector's source of time.
pub trait Clock: Send + Sync + 'static {
    /// Wall clock in nanoseconds since 1970-01-01 UTC. Stamped on arrivals; never a key or an order.
    fn utc_ns(&self) -> i64;

    /// Time since a fixed moment; never goes back. Ages are measured with it.
    fn monotonic(&self) -> Duration;
}

/// The machine's clocks.
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

/// The two clocks must differ by this much before the new difference is stored: every batch reads it, few write it.
const DRIFT_MIN_NS: u64 = 1_000_000;

#[derive(Debug)]
pub(crate) struct WallSteps(AtomicI64);

impl WallSteps {
    pub(crate) fn new(clock: &dyn Clock) -> Self {
        Self(AtomicI64::new(lead(clock.utc_ns(), clock.monotonic())))
    }

    /// The wall clock's step in nanoseconds since the last call; `None` if there was none.
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
