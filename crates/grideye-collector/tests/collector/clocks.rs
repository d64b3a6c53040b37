//! Clocks under the test's control, wall clock and monotonic clock separately.

use grideye_collector::Clock;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;

pub(crate) const SECOND_NS: i64 = 1_000_000_000;
pub(crate) const BEGIN_NS: i64 = 1_700_000_000 * SECOND_NS;

/// Wall clock and monotonic clock of a machine.
pub(crate) struct Clocks {
    utc_ns: AtomicI64,
    monotonic_ns: AtomicI64,
}

impl Clocks {
    /// The clocks of a machine that just started at this wall time.
    pub(crate) fn started_at(utc_ns: i64) -> Arc<Self> {
        Arc::new(Self {
            utc_ns: AtomicI64::new(utc_ns),
            monotonic_ns: AtomicI64::new(3 * SECOND_NS),
        })
    }

    pub(crate) fn pass(&self, time: Duration) {
        let ns = i64::try_from(time.as_nanos()).unwrap();
        self.utc_ns.fetch_add(ns, Ordering::SeqCst);
        self.monotonic_ns.fetch_add(ns, Ordering::SeqCst);
    }

    pub(crate) fn set_wall(&self, utc_ns: i64) {
        self.utc_ns.store(utc_ns, Ordering::SeqCst);
    }

    /// For the functions that open a store.
    pub(crate) fn handed(self: &Arc<Self>) -> Arc<dyn Clock> {
        let clock: Arc<Self> = Arc::clone(self);
        clock
    }
}

impl Clock for Clocks {
    fn utc_ns(&self) -> i64 {
        self.utc_ns.load(Ordering::SeqCst)
    }

    fn monotonic(&self) -> Duration {
        Duration::from_nanos(self.monotonic_ns.load(Ordering::SeqCst).unsigned_abs())
    }
}
