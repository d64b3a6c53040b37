//! The watchdog of a bus: a stuck transfer blocks its own thread and nothing else.
//!
//! The kernel ends a transfer on a bus held low after about a second. A faulty adapter or driver never does, and a
//! thread inside the kernel cannot be interrupted. So a second thread shares the sensors of the bus: it notices that
//! the first one has worked too long, logs it, and records the missed frames.

use super::sensor::{Sensor, Sink};
use crate::clock::Clock;
use crate::lock::lock;
use crate::log::Log;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A bus operation that takes this long counts as hung. A set-up that times out stops at its first transfer, well
/// before.
pub const HUNG_AFTER: Duration = Duration::from_secs(5);
/// Looks in that time.
const LOOKS: u32 = 10;

/// The sensors of one bus, and since when its thread has been working.
pub(crate) struct Watched {
    sensors: Mutex<Vec<Sensor>>,
    work: Mutex<Work>,
    is_over: Condvar,
}

#[derive(Debug, Default)]
struct Work {
    since: Option<Instant>,
    hangs: bool,
    is_over: bool,
}
enum Look {
    Well,
    Hangs { is_new: bool, since: Duration },
}

impl Watched {
    pub(crate) fn new(sensors: Vec<Sensor>) -> Self {
        Self {
            sensors: Mutex::new(sensors),
            work: Mutex::default(),
            is_over: Condvar::new(),
        }
    }

    /// Locks the sensors for `work`. Never held during a transfer.
    pub(crate) fn with<T>(&self, work: impl FnOnce(&mut Vec<Sensor>) -> T) -> T {
        work(&mut lock(&self.sensors))
    }
    pub(crate) fn hand_on(&self, sink: &impl Sink, clock: &dyn Clock, log: &Log) {
        self.with(|sensors| {
            for (index, sensor) in sensors.iter_mut().enumerate() {
                sensor.hand_on(index, sink, clock, log);
            }
        });
    }
    pub(crate) fn begin(&self) {
        lock(&self.work).since = Some(Instant::now());
    }

    /// The operation has returned. Returns whether it had counted as hung.
    pub(crate) fn end(&self) -> bool {
        let mut work = lock(&self.work);
        work.since = None;
        std::mem::take(&mut work.hangs)
    }
    pub(crate) fn over(&self) {
        lock(&self.work).is_over = true;
        self.is_over.notify_all();
    }

    pub(crate) fn watch(
        &self,
        (bus, hung_after): (&str, Duration),
        sink: &impl Sink,
        clock: &dyn Clock,
        log: &Log,
    ) {
        while let Some(look) = self.look(hung_after) {
            let Look::Hangs { is_new, since } = look else {
                continue;
            };
            if is_new {
                log.error(format!(
                    "{bus}: transfer has been stuck for {:.0} s\nhint: the other buses and the uploads continue; if it stays stuck, \
                     check the wires and the adapter, and restart the device",
                    since.as_secs_f64()
                ));
            }
            let now = clock.boot();
            self.with(|sensors| {
                for sensor in sensors {
                    if is_new {
                        sensor.sampler.hung(now);
                    }
                    sensor.sampler.catch_up(now);
                }
            });
            self.hand_on(sink, clock, log);
        }
    }

    /// `None` once it is over.
    fn look(&self, hung_after: Duration) -> Option<Look> {
        let goes_on = |work: &mut Work| !work.is_over;
        let waited = self
            .is_over
            .wait_timeout_while(lock(&self.work), hung_after / LOOKS, goes_on);
        let (mut work, _) = waited.unwrap_or_else(PoisonError::into_inner);
        if work.is_over {
            return None;
        }
        let since = work.since.map(|since| since.elapsed());
        Some(match since.filter(|since| *since >= hung_after) {
            None => Look::Well,
            Some(since) => Look::Hangs {
                is_new: !std::mem::replace(&mut work.hangs, true),
                since,
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HUNG_AFTER: Duration = Duration::from_millis(10);

    #[test]
    fn a_finished_transfer_never_counts_as_hung_and_a_stuck_one_is_new_once() {
        let watched = Watched::new(Vec::new());
        watched.begin();
        assert!(!watched.end());
        for _ in 0..2 * LOOKS {
            assert!(matches!(watched.look(HUNG_AFTER), Some(Look::Well)));
        }
        watched.begin();
        let looks: Vec<Look> = (0..2 * LOOKS)
            .filter_map(|_| watched.look(HUNG_AFTER))
            .collect();
        let hangs = |look: &&Look| matches!(look, Look::Hangs { .. });
        let again = |look: &&Look| matches!(look, Look::Hangs { is_new: true, .. });
        assert_eq!(looks.iter().filter(again).count(), 1);
        assert!(looks.iter().filter(hangs).count() > 1);
        assert!(watched.end(), "it had counted as hung");
        assert!(matches!(watched.look(HUNG_AFTER), Some(Look::Well)));
        watched.over();
        assert!(watched.look(HUNG_AFTER).is_none());
    }
}
