//! The clock a bus runs on, and a manual clock for tests.

use core::time::Duration;

/// The time source of an emulated bus: [`ManualClock`] in a test, a real-time clock in a program.
pub trait Clock {
    /// The time since any fixed origin. Never runs backwards.
    fn now(&self) -> Duration;

    /// Called when the bus was busy for this long: an emulated clock advances, a real one ignores it.
    fn pass(&self, bus_time: Duration) {
        let _ = bus_time;
    }

    /// Called when a caller waits until this time: an emulated clock advances to it, a real one ignores it.
    fn wait(&self, until: Duration) {
        let _ = until;
    }
}

macro_rules! pointers {
    ($($pointer:ty),+) => {
        $(impl<C: Clock + ?Sized> Clock for $pointer {
            fn now(&self) -> Duration {
                (**self).now()
            }

            fn pass(&self, bus_time: Duration) {
                (**self).pass(bus_time);
            }

            fn wait(&self, until: Duration) {
                (**self).wait(until);
            }
        })+
    };
}

pointers!(&C);
#[cfg(feature = "alloc")]
pointers!(alloc::rc::Rc<C>);
// Microcontrollers without atomic pointers have no Arc.
#[cfg(all(feature = "alloc", target_has_atomic = "ptr"))]
pointers!(alloc::sync::Arc<C>);

#[cfg(target_has_atomic = "64")]
pub use manual::ManualClock;

#[cfg(target_has_atomic = "64")]
mod manual {
    use crate::clock::Clock;
    use core::sync::atomic::{AtomicU64, Ordering};
    use core::time::Duration;

    /// A clock that starts at zero and moves only when told to and when the bus spends time; saturates after 584 years.
    #[derive(Debug, Default)]
    pub struct ManualClock(AtomicU64);

    impl ManualClock {
        /// A clock at zero.
        #[must_use]
        pub const fn new() -> Self {
            Self(AtomicU64::new(0))
        }

        /// Advances to this time; a time in the past changes nothing.
        pub fn set(&self, time: Duration) {
            self.0.fetch_max(nanoseconds(time), Ordering::SeqCst);
        }

        /// Advances by this much.
        pub fn advance(&self, by: Duration) {
            let moved = |time: u64| Some(time.saturating_add(nanoseconds(by)));
            // The closure always yields a value, so the update cannot fail.
            let _ = self
                .0
                .fetch_update(Ordering::SeqCst, Ordering::SeqCst, moved);
        }
    }

    impl Clock for ManualClock {
        fn now(&self) -> Duration {
            Duration::from_nanos(self.0.load(Ordering::SeqCst))
        }

        fn pass(&self, bus_time: Duration) {
            self.advance(bus_time);
        }

        fn wait(&self, until: Duration) {
            self.set(until);
        }
    }

    fn nanoseconds(time: Duration) -> u64 {
        u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn moves_only_forwards_and_saturates_at_its_end() {
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
            clock.advance(Duration::MAX);
            clock.advance(Duration::MAX);
            assert_eq!(clock.now(), Duration::from_nanos(u64::MAX));
        }
    }
}
