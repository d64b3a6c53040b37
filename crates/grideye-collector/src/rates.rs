//! Rate limits: one token bucket per caller.

use crate::lock::lock;
use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Mutex;
use std::time::Duration;

/// A bucket for each of a bounded number of callers, kept as the moment when it is full again (GCRA).
pub(crate) struct Rates<K> {
    /// The time in which one request comes back.
    every: Duration,
    /// The time in which an empty bucket fills.
    burst: Duration,
    callers_max: usize,
    full_at: Mutex<FullAt<K>>,
}

struct FullAt<K> {
    of: HashMap<K, Duration>,
    /// Shared by all callers beyond the limit.
    of_the_rest: Duration,
}

impl<K: Eq + Hash> Rates<K> {
    /// `per_second` requests in the long run, `burst` at once; individual buckets for `callers_max`.
    pub(crate) fn new(per_second: u32, burst: u32, callers_max: usize) -> Self {
        let every = Duration::from_secs(1) / per_second.max(1);
        Self {
            every,
            burst: every * burst.max(1),
            callers_max,
            full_at: Mutex::new(FullAt {
                of: HashMap::new(),
                of_the_rest: Duration::ZERO,
            }),
        }
    }

    /// Takes one request from the caller's bucket; if it is empty, returns the time until it is not.
    pub(crate) fn take(&self, caller: K, now: Duration) -> Result<(), Duration> {
        self.take_or_look(caller, now, true)
    }

    /// The same without taking it.
    pub(crate) fn look(&self, caller: K, now: Duration) -> Result<(), Duration> {
        self.take_or_look(caller, now, false)
    }

    /// What the caller who took most has taken.
    pub(crate) fn most_taken(&self, now: Duration) -> u64 {
        let full_at = lock(&self.full_at).of.values().max().copied();
        let taken = full_at.unwrap_or_default().saturating_sub(now).as_nanos();
        u64::try_from(taken.div_ceil(self.every.as_nanos().max(1))).unwrap_or(u64::MAX)
    }

    fn take_or_look(&self, caller: K, now: Duration, takes: bool) -> Result<(), Duration> {
        let FullAt { of, of_the_rest } = &mut *lock(&self.full_at);
        if !of.contains_key(&caller) && of.len() >= self.callers_max {
            // A caller with a full bucket can be forgotten.
            of.retain(|_, full_at| *full_at > now);
        }
        let full_at = if of.len() < self.callers_max || of.contains_key(&caller) {
            of.entry(caller).or_default()
        } else {
            of_the_rest
        };
        let then_full_at = now.max(*full_at) + self.every;
        match then_full_at.saturating_sub(now + self.burst) {
            Duration::ZERO => {
                if takes {
                    *full_at = then_full_at;
                }
                Ok(())
            }
            wait => Err(wait),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    fn taken(rates: &Rates<&'static str>, caller: &'static str, now: Duration) -> usize {
        (0..1000)
            .take_while(|_| rates.take(caller, now).is_ok())
            .count()
    }

    #[test]
    fn a_burst_then_a_steady_rate() {
        let rates = Rates::new(10, 5, 100);
        assert_eq!(taken(&rates, "a", at(0)), 5);
        assert_eq!(rates.take("a", at(0)), Err(Duration::from_millis(100)));
        assert_eq!(rates.take("a", at(60)), Err(Duration::from_millis(40)));
        assert_eq!(taken(&rates, "a", at(300)), 3);
        // Never more than a burst.
        assert_eq!(taken(&rates, "a", at(100_000)), 5);
        // Over ten seconds: the burst plus 10 per second.
        let rates = Rates::new(10, 5, 100);
        let all: usize = (0..=1000)
            .map(|tick| taken(&rates, "a", at(10 * tick)))
            .sum();
        assert!((104..=105).contains(&all), "{all}");
    }

    #[test]
    fn callers_do_not_take_from_each_other() {
        let rates = Rates::new(10, 5, 100);
        assert_eq!(taken(&rates, "a", at(0)), 5);
        assert_eq!(taken(&rates, "b", at(0)), 5);
        assert_eq!(taken(&rates, "c", at(1000)), 5);
        // A clock that stops or goes back adds nothing.
        assert_eq!(taken(&rates, "c", at(0)), 0);
        assert_eq!(taken(&rates, "c", at(1000)), 0);
    }

    #[test]
    fn callers_beyond_the_limit_share_a_bucket_until_others_are_idle() {
        let rates = Rates::new(10, 5, 2);
        assert_eq!(taken(&rates, "a", at(0)), 5);
        assert_eq!(taken(&rates, "b", at(0)), 5);
        assert_eq!(taken(&rates, "c", at(0)) + taken(&rates, "d", at(0)), 5);
        assert_eq!(rates.full_at.lock().unwrap().of.len(), 2);
        // After half a second a and b are full again and make room.
        assert_eq!(taken(&rates, "c", at(500)), 5);
        assert_eq!(taken(&rates, "d", at(500)), 5);
        assert_eq!(rates.full_at.lock().unwrap().of.len(), 2);
    }
}
