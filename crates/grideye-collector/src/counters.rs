//! Counters since the collector started.

use crate::lock::lock;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Upper bounds of the request time histogram, in seconds.
pub(crate) const TIME_CLASSES_S: [f64; 10] =
    [0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 5.0];

#[derive(Debug, Default)]
pub(crate) struct Counters {
    /// Responses by status class: 1xx to 5xx.
    by_class: [AtomicU64; 5],
    /// Requests per time class; the last has no upper bound.
    by_time: [AtomicU64; TIME_CLASSES_S.len() + 1],
    time_ns: AtomicU64,
    refused: Mutex<BTreeMap<&'static str, u64>>,
    /// Frames that were new.
    pub(crate) frames_stored: AtomicU64,
    /// Frames that were already stored.
    pub(crate) frames_again: AtomicU64,
    pub(crate) connections_open: AtomicU64,
    pub(crate) connections: AtomicU64,
    /// Connections closed to make room for a newer one.
    pub(crate) displaced: AtomicU64,
    /// Connections refused because the limit was reached.
    pub(crate) turned_away: AtomicU64,
    /// Connections that ended before the TLS handshake finished.
    pub(crate) tls_failed: AtomicU64,
}

impl Counters {
    pub(crate) fn answered(&self, status: u16, took: Duration) {
        let class = usize::from(status / 100).clamp(1, 5) - 1;
        self.by_class[class].fetch_add(1, Ordering::Relaxed);
        let took_s = took.as_secs_f64();
        let place = TIME_CLASSES_S.partition_point(|end| *end < took_s);
        self.by_time[place].fetch_add(1, Ordering::Relaxed);
        let ns = u64::try_from(took.as_nanos()).unwrap_or(u64::MAX);
        self.time_ns.fetch_add(ns, Ordering::Relaxed);
    }

    /// The codes come from this program, so there are few.
    pub(crate) fn refused(&self, code: &'static str) {
        *lock(&self.refused).entry(code).or_default() += 1;
    }

    pub(crate) fn refusals(&self) -> BTreeMap<&'static str, u64> {
        lock(&self.refused).clone()
    }

    pub(crate) fn by_class(&self) -> [u64; 5] {
        self.by_class.each_ref().map(load)
    }

    pub(crate) fn by_time(&self) -> [u64; TIME_CLASSES_S.len() + 1] {
        self.by_time.each_ref().map(load)
    }

    pub(crate) fn time_s(&self) -> f64 {
        Duration::from_nanos(load(&self.time_ns)).as_secs_f64()
    }
}

pub(crate) fn load(counter: &AtomicU64) -> u64 {
    counter.load(Ordering::Relaxed)
}

pub(crate) fn add(counter: &AtomicU64, count: usize) {
    counter.fetch_add(u64::try_from(count).unwrap_or(u64::MAX), Ordering::Relaxed);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_counted_by_class_and_by_time() {
        let counters = Counters::default();
        for (status, ms) in [(200, 0), (204, 1), (404, 2), (503, 9000), (99, 3)] {
            counters.answered(status, Duration::from_millis(ms));
        }
        assert_eq!(counters.by_class(), [1, 2, 0, 1, 1]);
        // 1 ms belongs to the class that ends there.
        assert_eq!(counters.by_time(), [2, 1, 1, 0, 0, 0, 0, 0, 0, 0, 1]);
        assert!((counters.time_s() - 9.006).abs() < 1e-9);
    }

    #[test]
    fn refusals_are_counted_by_code() {
        let counters = Counters::default();
        for code in ["a", "b", "a"] {
            counters.refused(code);
        }
        assert_eq!(counters.refusals(), BTreeMap::from([("a", 2), ("b", 1)]));
    }
}
