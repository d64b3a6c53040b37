//! Rate limits: one token bucket per caller.

use crate::lock::lock;
use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Mutex;
use std::time::Duration;

/// A bucket for each of a bounded number of callers.
pub(crate) struct Rates<K> {
    per_second: f64,
    burst: f64,
    callers_max: usize,
    buckets: Mutex<Buckets<K>>,
}

struct Buckets<K> {
    of: HashMap<K, Bucket>,
    /// Shared by all callers beyond the limit.
    of_the_rest: Bucket,
}

#[derive(Debug, Clone, Copy)]
struct Bucket {
    left: f64,
    filled_at: Duration,
}

impl<K: Eq + Hash> Rates<K> {
    /// `per_second` requests in the long run, `burst` at once; individual buckets for `callers_max`.
    pub(crate) fn new(per_second: u32, burst: u32, callers_max: usize) -> Self {
        let burst = f64::from(burst.max(1));
        Self {
            per_second: f64::from(per_second.max(1)),
            burst,
            callers_max,
            buckets: Mutex::new(Buckets {
                of: HashMap::new(),
                of_the_rest: Bucket {
                    left: burst,
                    filled_at: Duration::ZERO,
                },
            }),
        }
    }

    /// Takes one request from the caller's bucket; if it is empty, returns the time until it is not.
    pub(crate) fn take(&self, caller: K, now: Duration) -> Result<(), Duration> {
        let mut buckets = lock(&self.buckets);
        if !buckets.of.contains_key(&caller) && buckets.of.len() >= self.callers_max {
            // A caller with a full bucket can be forgotten.
            buckets
                .of
                .retain(|_, bucket| self.filled(*bucket, now).left < self.burst);
        }
        let has_room = buckets.of.len() < self.callers_max || buckets.of.contains_key(&caller);
        let full = Bucket {
            left: self.burst,
            filled_at: now,
        };
        let bucket = if has_room {
            buckets.of.entry(caller).or_insert(full)
        } else {
            &mut buckets.of_the_rest
        };
        *bucket = self.filled(*bucket, now);
        if bucket.left >= 1.0 {
            bucket.left -= 1.0;
            return Ok(());
        }
        Err(Duration::from_secs_f64(
            (1.0 - bucket.left) / self.per_second,
        ))
    }

    fn filled(&self, bucket: Bucket, now: Duration) -> Bucket {
        let passed = now.saturating_sub(bucket.filled_at).as_secs_f64();
        Bucket {
            left: (bucket.left + passed * self.per_second).min(self.burst),
            filled_at: now.max(bucket.filled_at),
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
        assert_eq!(rates.buckets.lock().unwrap().of.len(), 2);
        // After half a second a and b are full again and make room.
        assert_eq!(taken(&rates, "c", at(500)), 5);
        assert_eq!(taken(&rates, "d", at(500)), 5);
        assert_eq!(rates.buckets.lock().unwrap().of.len(), 2);
    }
}
