//! Real time for the emulated buses: sped up if asked for, and moved on by the bits of a slow bus.

use amg8833_emulator::Clock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// Where all buses take their time from. It stands still until it is started.
#[derive(Debug)]
pub struct Timebase {
    started: OnceLock<Instant>,
    ahead: Duration,
    speed: f64,
}

impl Timebase {
    /// Stands at zero; once started, it shows `ahead` and runs `speed` (positive) times as fast as real time.
    #[must_use]
    pub fn new(ahead: Duration, speed: f64) -> Arc<Self> {
        Arc::new(Self {
            started: OnceLock::new(),
            ahead,
            speed,
        })
    }

    /// Lets it run, if it does not yet.
    pub(crate) fn start(&self) {
        self.started.get_or_init(Instant::now);
    }

    fn now(&self) -> Duration {
        self.started.get().map_or(Duration::ZERO, |started| {
            self.ahead
                .saturating_add(scaled(started.elapsed(), self.speed))
        })
    }
}

/// The time of one bus. While it transfers, its bits run ahead of real time; [`settle`](Self::settle) waits for that.
#[derive(Debug)]
pub(crate) struct BusClock {
    base: Arc<Timebase>,
    busy_until_ns: AtomicU64,
    held_ns: AtomicU64,
}

/// The clock follows the machine's time.
const NOT_HELD: u64 = u64::MAX;

impl BusClock {
    /// A bus of this machine.
    pub(crate) fn new(base: &Arc<Timebase>) -> Arc<Self> {
        Arc::new(Self {
            base: Arc::clone(base),
            busy_until_ns: AtomicU64::new(0),
            held_ns: AtomicU64::new(NOT_HELD),
        })
    }

    /// From here on only bits move this bus's time, so that a transfer is as long as its bits, and not as this program
    /// takes for it.
    pub(crate) fn hold(&self) {
        let now_ns = u64::try_from(self.now().as_nanos()).unwrap_or(NOT_HELD);
        self.held_ns.store(now_ns, Ordering::SeqCst);
    }

    /// The time of this bus follows the machine's again.
    pub(crate) fn release(&self) {
        self.held_ns.store(NOT_HELD, Ordering::SeqCst);
    }

    /// Waits until the bus has had the time for its bits.
    pub(crate) fn settle(&self) {
        let busy_until = Duration::from_nanos(self.busy_until_ns.load(Ordering::SeqCst));
        if let Some(early) = busy_until.checked_sub(self.base.now()) {
            std::thread::sleep(scaled(early, self.base.speed.recip()));
        }
    }
}

impl Clock for BusClock {
    fn now(&self) -> Duration {
        let busy_until = Duration::from_nanos(self.busy_until_ns.load(Ordering::SeqCst));
        let time = match self.held_ns.load(Ordering::SeqCst) {
            NOT_HELD => self.base.now(),
            held_ns => Duration::from_nanos(held_ns),
        };
        time.max(busy_until)
    }

    fn pass(&self, bus_time: Duration) {
        let until = self.now().saturating_add(bus_time);
        let until_ns = u64::try_from(until.as_nanos()).unwrap_or(u64::MAX);
        self.busy_until_ns.fetch_max(until_ns, Ordering::SeqCst);
    }
}

/// A duration times a positive factor; what no duration can hold is the longest one.
fn scaled(duration: Duration, factor: f64) -> Duration {
    Duration::try_from_secs_f64(duration.as_secs_f64() * factor).unwrap_or(Duration::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stands_until_it_is_started_and_then_is_ahead() {
        let base = Timebase::new(Duration::from_millis(200), 1.0);
        let clock = BusClock::new(&base);
        assert_eq!(clock.now(), Duration::ZERO);
        base.start();
        assert!(clock.now() >= Duration::from_millis(200));
    }

    #[test]
    fn speed_multiplies_time() {
        let base = Timebase::new(Duration::ZERO, 1000.0);
        base.start();
        let started = Instant::now();
        std::thread::sleep(Duration::from_millis(5));
        let (emulated, real) = (base.now(), started.elapsed());
        assert!(
            emulated >= Duration::from_secs(5),
            "{emulated:?} in {real:?}"
        );
    }

    #[test]
    fn bits_move_their_bus_alone_and_settling_waits_for_them() {
        let base = Timebase::new(Duration::ZERO, 10.0);
        base.start();
        let (busy, idle) = (BusClock::new(&base), BusClock::new(&base));
        let started = Instant::now();
        busy.pass(Duration::from_secs(1));
        assert!(busy.now() >= Duration::from_secs(1));
        assert!(
            idle.now() < Duration::from_secs(1) || started.elapsed() >= Duration::from_millis(100)
        );
        busy.settle();
        assert!(
            started.elapsed() >= Duration::from_millis(100),
            "one second at ten times the speed"
        );
    }

    #[test]
    fn a_bus_that_is_held_is_moved_by_its_bits_alone() {
        let base = Timebase::new(Duration::ZERO, 1000.0);
        base.start();
        let clock = BusClock::new(&base);
        clock.hold();
        let held = clock.now();
        std::thread::sleep(Duration::from_millis(2));
        assert_eq!(clock.now(), held);
        clock.pass(Duration::from_micros(90));
        assert_eq!(clock.now(), held + Duration::from_micros(90));
        clock.release();
        assert!(clock.now() >= held + Duration::from_secs(2));
    }

    #[test]
    fn what_no_duration_holds_saturates() {
        assert_eq!(scaled(Duration::MAX, 2.0), Duration::MAX);
        assert_eq!(
            scaled(Duration::from_secs(3), 0.5),
            Duration::from_millis(1500)
        );
    }
}
