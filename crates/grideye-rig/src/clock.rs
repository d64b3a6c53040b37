//! Clocks of the emulated buses: real time, optionally sped up and advanced by the bits of a slow bus; time that is moved
//! by hand; or paced time.

use amg8833_emulator::Clock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// The time source of all buses. It stands still until started.
#[derive(Debug)]
pub struct Timebase {
    ahead: Duration,
    pace: Pace,
}

#[derive(Debug)]
enum Pace {
    Real {
        started: OnceLock<Instant>,
        speed: f64,
    },
    /// The time now, in nanoseconds.
    Hand(AtomicU64),
}

impl Timebase {
    /// Starts at zero; once started, runs from `ahead` at `speed` (positive) times real time.
    #[must_use]
    pub fn new(ahead: Duration, speed: f64) -> Arc<Self> {
        let started = OnceLock::new();
        let pace = Pace::Real { started, speed };
        Arc::new(Self { ahead, pace })
    }

    /// Starts at zero; once started, stands at `ahead`, and only [`Machine::advance`](crate::Machine::advance) and the bits of a slow bus
    /// move it.
    #[must_use]
    pub fn by_hand(ahead: Duration) -> Arc<Self> {
        let pace = Pace::Hand(AtomicU64::new(0));
        Arc::new(Self { ahead, pace })
    }

    pub(crate) fn start(&self) {
        match &self.pace {
            Pace::Real { started, .. } => {
                started.get_or_init(Instant::now);
            }
            Pace::Hand(_) => self.reach(self.ahead),
        }
    }

    /// Moves time that is moved by hand; real time goes by itself.
    pub(crate) fn advance(&self, by: Duration) {
        self.reach(self.now().saturating_add(by));
    }

    fn reach(&self, until: Duration) {
        if let Pace::Hand(now_ns) = &self.pace {
            now_ns.fetch_max(nanoseconds(until), Ordering::SeqCst);
        }
    }

    pub(crate) fn now(&self) -> Duration {
        match &self.pace {
            Pace::Real { started, speed } => started.get().map_or(Duration::ZERO, |started| {
                let run = scaled(started.elapsed(), *speed);
                self.ahead.saturating_add(run)
            }),
            Pace::Hand(now_ns) => Duration::from_nanos(now_ns.load(Ordering::SeqCst)),
        }
    }

    /// Waits until this time; time that is moved by hand comes to it at once.
    pub(crate) fn wait(&self, until: Duration) {
        match (&self.pace, until.checked_sub(self.now())) {
            (Pace::Real { speed, .. }, Some(early)) => {
                std::thread::sleep(scaled(early, speed.recip()));
            }
            _ => self.reach(until),
        }
    }
}

/// The time of one bus. Its bits run ahead of real time until [`settle`](Self::settle) waits for it.
#[derive(Debug)]
pub(crate) struct BusClock {
    base: Arc<Timebase>,
    busy_until_ns: AtomicU64,
    held_ns: AtomicU64,
}

/// The clock follows the machine's time.
const NOT_HELD: u64 = u64::MAX;

impl BusClock {
    pub(crate) fn new(base: &Arc<Timebase>) -> Arc<Self> {
        Arc::new(Self {
            base: Arc::clone(base),
            busy_until_ns: AtomicU64::new(0),
            held_ns: AtomicU64::new(NOT_HELD),
        })
    }

    /// From now on only bits advance this bus's time, so that a transfer takes exactly as long as its bits.
    pub(crate) fn hold(&self) {
        let now_ns = nanoseconds(self.now());
        self.held_ns.store(now_ns, Ordering::SeqCst);
    }

    /// This bus's time follows the machine's again.
    pub(crate) fn release(&self) {
        self.held_ns.store(NOT_HELD, Ordering::SeqCst);
    }

    /// Waits until real time has caught up with the bits.
    pub(crate) fn settle(&self) {
        let busy_until = Duration::from_nanos(self.busy_until_ns.load(Ordering::SeqCst));
        self.base.wait(busy_until);
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
        let until_ns = nanoseconds(until);
        self.busy_until_ns.fetch_max(until_ns, Ordering::SeqCst);
    }
}

/// Emulated time, at most `speed` times real time, that advances only while someone waits for it or the bus transfers:
/// if the host stalls, so does the sensor.
#[derive(Debug)]
pub struct PacedClock {
    now_ns: AtomicU64,
    speed: f64,
    started: Instant,
    /// Real time not charged to the emulated clock, because nobody asked it to advance.
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

    /// Advances emulated time to `until`, and waits until real time has caught up.
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
            // The host was late; emulated time does not catch up.
            *origin = real.saturating_sub(due);
        }
        wait
    }
}

impl Clock for PacedClock {
    fn now(&self) -> Duration {
        Duration::from_nanos(self.now_ns.load(Ordering::SeqCst))
    }

    fn pass(&self, bus_time: Duration) {
        let passed = nanoseconds(bus_time);
        self.now_ns.fetch_add(passed, Ordering::SeqCst);
    }
}

pub(crate) fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// A duration times a positive factor, saturating.
fn scaled(duration: Duration, factor: f64) -> Duration {
    Duration::try_from_secs_f64(duration.as_secs_f64() * factor).unwrap_or(Duration::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stands_until_it_is_started_and_then_is_ahead_and_multiplied() {
        let base = Timebase::new(Duration::from_millis(200), 100.0);
        let clock = BusClock::new(&base);
        assert_eq!(clock.now(), Duration::ZERO);
        base.start();
        assert!(clock.now() >= Duration::from_millis(200));
        std::thread::sleep(Duration::from_millis(5));
        assert!(base.now() >= Duration::from_millis(700));
        assert_eq!(scaled(Duration::MAX, 2.0), Duration::MAX, "it saturates");
        let half = scaled(Duration::from_secs(3), 0.5);
        assert_eq!(half, Duration::from_millis(1500));
    }

    #[test]
    fn time_moved_by_hand_stands_until_it_is_moved_or_bits_pass() {
        let base = Timebase::by_hand(Duration::from_millis(250));
        let clock = BusClock::new(&base);
        base.advance(Duration::ZERO);
        assert_eq!(clock.now(), Duration::ZERO);
        base.start();
        std::thread::sleep(Duration::from_millis(2));
        assert_eq!(clock.now(), Duration::from_millis(250));
        base.advance(Duration::from_secs(3600));
        assert_eq!(clock.now(), Duration::from_millis(3_600_250));
        let started = Instant::now();
        clock.pass(Duration::from_secs(30));
        clock.settle();
        assert_eq!(base.now(), Duration::from_millis(3_630_250));
        assert!(started.elapsed() < Duration::from_secs(30), "nobody waits");
    }

    #[test]
    fn bits_move_their_bus_alone_and_settling_waits_for_them() {
        let base = Timebase::new(Duration::ZERO, 10.0);
        base.start();
        let (busy, idle) = (BusClock::new(&base), BusClock::new(&base));
        let started = Instant::now();
        busy.pass(Duration::from_secs(1));
        assert!(busy.now() >= Duration::from_secs(1));
        // One second at ten times the speed.
        let real = Duration::from_millis(100);
        assert!(idle.now() < Duration::from_secs(1) || started.elapsed() >= real);
        busy.settle();
        assert!(started.elapsed() >= real);
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
    fn time_moves_only_when_it_is_waited_for_or_the_bus_transfers() {
        let clock = PacedClock::new(1000.0);
        std::thread::sleep(Duration::from_millis(5));
        assert_eq!(clock.now(), Duration::ZERO);
        clock.pass(Duration::from_micros(12_300));
        clock.sleep_until(Duration::from_millis(100));
        assert_eq!(clock.now(), Duration::from_millis(100));
        clock.sleep_until(Duration::from_millis(50));
        assert_eq!(clock.now(), Duration::from_millis(100));
        // Waiting takes the real time that the speed implies.
        let clock = PacedClock::new(10.0);
        let started = Instant::now();
        clock.sleep_until(Duration::from_millis(300));
        assert!(started.elapsed() >= Duration::from_millis(30));
    }
}
