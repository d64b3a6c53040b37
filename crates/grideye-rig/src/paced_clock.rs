//! The time of an emulated bus: it moves only while somebody waits for it or the bus transfers, and is paced against
//! the real clock.
//!
//! A host that stalls for a moment stalls the emulated sensor with it, so the demonstration shows what the recorder
//! does and not how busy this computer is. On a Raspberry Pi the agent runs on the system's clock.

use amg8833_emulator::Clock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Emulated time, `speed` times as fast as real time at the most.
#[derive(Debug)]
pub struct PacedClock {
    now_ns: AtomicU64,
    speed: f64,
    started: Instant,
    /// Real time that the emulated clock is not charged for, because nobody asked it to move.
    origin: Mutex<Duration>,
}

impl PacedClock {
    /// A clock that starts at zero now. `speed` must be positive.
    #[must_use]
    pub fn new(speed: f64) -> Self {
        Self {
            now_ns: AtomicU64::new(0),
            speed,
            started: Instant::now(),
            origin: Mutex::new(Duration::ZERO),
        }
    }

    /// Emulated time since the start.
    #[must_use]
    pub fn now(&self) -> Duration {
        Duration::from_nanos(self.now_ns.load(Ordering::SeqCst))
    }

    /// Moves emulated time on without waiting: the time that a transfer takes on the bus.
    pub fn pass(&self, duration: Duration) {
        self.now_ns
            .fetch_add(nanoseconds(duration), Ordering::SeqCst);
    }

    /// Moves emulated time on to `until`, and waits until real time has caught up with it.
    pub fn sleep_until(&self, until: Duration) {
        self.now_ns.fetch_max(nanoseconds(until), Ordering::SeqCst);
        let due = self.now().div_f64(self.speed);
        if let Some(wait) = self.wait_for(due) {
            std::thread::sleep(wait);
        }
    }

    fn wait_for(&self, due: Duration) -> Option<Duration> {
        let mut origin = self.origin.lock().unwrap_or_else(PoisonError::into_inner);
        let real = self.started.elapsed();
        let wait = (*origin + due).checked_sub(real);
        if wait.is_none() {
            // The host was late: emulated time does not hurry after it.
            *origin = real.saturating_sub(due);
        }
        wait
    }
}

impl Clock for PacedClock {
    fn now(&self) -> Duration {
        PacedClock::now(self)
    }

    fn pass(&self, bus_time: Duration) {
        PacedClock::pass(self, bus_time);
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_moves_only_when_it_is_waited_for_or_the_bus_transfers() {
        let clock = PacedClock::new(1000.0);
        std::thread::sleep(Duration::from_millis(5));
        assert_eq!(clock.now(), Duration::ZERO);
        clock.pass(Duration::from_micros(12_300));
        clock.sleep_until(Duration::from_millis(100));
        assert_eq!(clock.now(), Duration::from_millis(100));
        clock.sleep_until(Duration::from_millis(50));
        assert_eq!(clock.now(), Duration::from_millis(100));
    }

    #[test]
    fn waiting_takes_the_real_time_that_the_speed_asks_for() {
        let clock = PacedClock::new(10.0);
        let started = Instant::now();
        clock.sleep_until(Duration::from_millis(300));
        assert!(started.elapsed() >= Duration::from_millis(30));
    }
}
