//! The time that a bus is handed, and clocks that tests move on.

use core::time::Duration;

/// Where an emulated bus takes its time from.
///
/// The emulator reads no clock by itself: a test hands in a [`ManualClock`], a program one that follows the real time.
pub trait Clock {
    /// The time since any fixed origin. Never runs backwards.
    fn now(&self) -> Duration;

    /// The bus was busy for this long. An emulated clock moves on by it; a real one has already done so and ignores it.
    fn pass(&self, bus_time: Duration) {
        let _ = bus_time;
    }

    /// Somebody waits for this time, for an edge of the INT pin. An emulated clock moves on to it; a real one, whose
    /// time comes by itself, ignores it.
    fn wait(&self, until: Duration) {
        let _ = until;
    }
}

impl<C: Clock + ?Sized> Clock for &C {
    fn now(&self) -> Duration {
        (**self).now()
    }

    fn pass(&self, bus_time: Duration) {
        (**self).pass(bus_time);
    }

    fn wait(&self, until: Duration) {
        (**self).wait(until);
    }
}

#[cfg(feature = "alloc")]
mod shared {
    use crate::clock::Clock;
    use alloc::rc::Rc;
    use core::time::Duration;
    // Microcontrollers without atomic pointers have no Arc.
    #[cfg(target_has_atomic = "ptr")]
    use alloc::sync::Arc;

    impl<C: Clock + ?Sized> Clock for Rc<C> {
        fn now(&self) -> Duration {
            (**self).now()
        }

        fn pass(&self, bus_time: Duration) {
            (**self).pass(bus_time);
        }

        fn wait(&self, until: Duration) {
            (**self).wait(until);
        }
    }

    #[cfg(target_has_atomic = "ptr")]
    impl<C: Clock + ?Sized> Clock for Arc<C> {
        fn now(&self) -> Duration {
            (**self).now()
        }

        fn pass(&self, bus_time: Duration) {
            (**self).pass(bus_time);
        }

        fn wait(&self, until: Duration) {
            (**self).wait(until);
        }
    }
}

#[cfg(target_has_atomic = "64")]
pub use manual::ManualClock;

#[cfg(target_has_atomic = "64")]
mod manual {
    use crate::clock::Clock;
    use core::sync::atomic::{AtomicU64, Ordering};
    use core::time::Duration;

    /// A clock that stands still until it is told to move, or until the bus spends time.
    ///
    /// Starts at zero and saturates after 584 years. Threads may share it.
    #[derive(Debug, Default)]
    pub struct ManualClock {
        nanoseconds: AtomicU64,
    }

    impl ManualClock {
        /// A clock that shows zero.
        #[must_use]
        pub const fn new() -> Self {
            Self {
                nanoseconds: AtomicU64::new(0),
            }
        }

        /// Moves on to this time; stays where it is when that is in the past.
        pub fn set(&self, time: Duration) {
            self.nanoseconds
                .fetch_max(saturated(time), Ordering::SeqCst);
        }

        /// Moves on by this much.
        pub fn advance(&self, by: Duration) {
            let step = saturated(by);
            // The closure always yields a value, so the update cannot fail.
            let _ = self
                .nanoseconds
                .fetch_update(Ordering::SeqCst, Ordering::SeqCst, |time| {
                    Some(time.saturating_add(step))
                });
        }
    }

    impl Clock for ManualClock {
        fn now(&self) -> Duration {
            Duration::from_nanos(self.nanoseconds.load(Ordering::SeqCst))
        }

        fn pass(&self, bus_time: Duration) {
            self.advance(bus_time);
        }

        fn wait(&self, until: Duration) {
            self.set(until);
        }
    }

    fn saturated(time: Duration) -> u64 {
        u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn moves_only_forwards() {
            let clock = ManualClock::new();
            clock.set(Duration::from_millis(5));
            clock.set(Duration::from_millis(3));
            assert_eq!(clock.now(), Duration::from_millis(5));
            clock.advance(Duration::from_millis(2));
            Clock::pass(&clock, Duration::from_micros(10));
            assert_eq!(clock.now(), Duration::from_micros(7_010));
            clock.wait(Duration::from_millis(9));
            clock.wait(Duration::from_millis(8));
            assert_eq!(clock.now(), Duration::from_millis(9));
        }

        #[test]
        fn saturates_at_its_end() {
            let clock = ManualClock::new();
            clock.advance(Duration::MAX);
            clock.advance(Duration::MAX);
            assert_eq!(clock.now(), Duration::from_nanos(u64::MAX));
        }
    }
}
