//! The agent's clocks: one that never goes back, and the wall clock, which a Raspberry Pi must get from the network.

use crate::lock::lock;
use grideye_recording::{ClockState, Stamp};
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

/// Time for the agent. Only the buses advance an emulated clock; the uploader waits in real time.
pub trait Clock: Send + Sync {
    /// Time since the device started, including suspend (`CLOCK_BOOTTIME`). Never goes back.
    fn boot(&self) -> Duration;

    /// Wall clock in nanoseconds since 1970-01-01 UTC, and whether it has been set.
    fn utc(&self) -> (i64, ClockState);

    /// Returns when [`Clock::boot`] has reached `boot`: maybe late, never early.
    fn sleep_until(&self, boot: Duration);
}

/// A wall clock that moves further than this against the boot clock between two frames was set. NTP slews less in a
/// second, and steps more (from 128 ms).
pub const STEP_MIN: Duration = Duration::from_millis(100);

/// 2024-01-01 UTC in seconds. An earlier wall clock has not been set, because this program is younger.
const EARLIEST_PLAUSIBLE_UTC_S: i64 = 1_704_067_200;

/// How long an answer about NTP stays valid before the file system is asked again.
const SYNC_ANSWER_VALID: Duration = Duration::from_secs(5);
const TIMESYNC_FOLDER: &str = "/run/systemd/timesync";
const TIMESYNC_DONE: &str = "synchronized";

/// Linux's clocks.
#[derive(Debug)]
pub struct SystemClock {
    timesync: PathBuf,
    /// Time and result of the last look at the file system.
    synchronized: Mutex<Option<(Duration, bool)>>,
}

impl SystemClock {
    /// This machine's clocks; the time service uses this folder.
    #[must_use]
    pub fn beside(timesync: impl Into<PathBuf>) -> Self {
        Self {
            timesync: timesync.into(),
            synchronized: Mutex::default(),
        }
    }

    /// Whether a time service has set the clock. Without systemd's folder, a plausible year must do.
    fn has_been_set(&self) -> bool {
        let now = self.boot();
        let mut answer = lock(&self.synchronized);
        match *answer {
            Some((asked, said)) if now.saturating_sub(asked) < SYNC_ANSWER_VALID => said,
            _ => {
                let said = self.timesync.join(TIMESYNC_DONE).exists() || !self.timesync.exists();
                *answer = Some((now, said));
                said
            }
        }
    }
}

impl Default for SystemClock {
    fn default() -> Self {
        Self::beside(TIMESYNC_FOLDER)
    }
}

impl Clock for SystemClock {
    fn boot(&self) -> Duration {
        let now = clock_gettime(ClockId::Boottime);
        now.try_into().unwrap_or_default()
    }

    fn utc(&self) -> (i64, ClockState) {
        // Before the clock, because a file system may take its time.
        let has_been_set = self.has_been_set();
        let now = clock_gettime(ClockId::Realtime);
        let utc_ns = now.tv_sec.saturating_mul(1_000_000_000);
        let utc_ns = utc_ns.saturating_add(now.tv_nsec);
        if now.tv_sec >= EARLIEST_PLAUSIBLE_UTC_S && has_been_set {
            (utc_ns, ClockState::Synced)
        } else {
            (utc_ns, ClockState::Unsynced)
        }
    }

    fn sleep_until(&self, boot: Duration) {
        let until = Timespec::try_from(boot).unwrap_or_default();
        // A signal ends the sleep early, so the loop sleeps again.
        while self.boot() < boot {
            if clock_nanosleep_absolute(ClockId::Boottime, &until).is_err() {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }
}

/// Looks at both clocks before the one that took the least time is taken, and the time that is not improved on.
const LOOKS: usize = 4;
const LOOK_NS: i64 = 1_000_000;

/// Wall time minus boot time, in nanoseconds.
#[derive(Debug, Clone, Copy)]
struct Offset {
    ns: i64,
    /// How long it took to look at both clocks: the host may be kept from running between them, or suspended.
    took_ns: i64,
    state: ClockState,
}

impl Offset {
    fn of(clock: &dyn Clock) -> Self {
        let mut before_ns = signed_ns(clock.boot());
        let mut look = || {
            let (utc_ns, state) = clock.utc();
            let after_ns = signed_ns(clock.boot());
            let took_ns = after_ns.saturating_sub(before_ns);
            let ns = utc_ns.saturating_sub(before_ns.saturating_add(took_ns / 2));
            before_ns = after_ns;
            Self { ns, took_ns, state }
        };
        let mut best = look();
        for _ in 1..LOOKS {
            if best.took_ns > LOOK_NS {
                let next = look();
                best = if next.took_ns < best.took_ns {
                    next
                } else {
                    best
                };
            }
        }
        best
    }
}

/// Stamps the records of one stream, and detects a wall clock set between two of them.
#[derive(Debug, Default)]
pub(crate) struct Stamper {
    /// At the previous record.
    last: Option<Offset>,
}

impl Stamper {
    /// The stamp of an event at `at` on the boot clock, shortly ago.
    pub(crate) fn stamp(&mut self, at: Duration, clock: &dyn Clock) -> Stamp {
        let offset = Offset::of(clock);
        let last = self.last.replace(offset).unwrap_or(offset);
        let moved_ns = offset.ns.saturating_sub(last.ns).saturating_abs();
        let unsure_ns = offset.took_ns.saturating_add(last.took_ns);
        let has_moved = moved_ns > signed_ns(STEP_MIN).saturating_add(unsure_ns);
        Stamp {
            t_boot_ns: unsigned_ns(at),
            t_utc_ns: signed_ns(at).saturating_add(offset.ns),
            clock: match offset.state {
                ClockState::Synced if has_moved => ClockState::Stepped,
                state => state,
            },
        }
    }
}

/// Nanoseconds for the wire; 584 years are enough.
pub(crate) fn unsigned_ns(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
pub(crate) fn signed_ns(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}

/// Nanoseconds as a duration; zero if negative.
pub(crate) fn duration(ns: i64) -> Duration {
    Duration::from_nanos(u64::try_from(ns).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicI64, Ordering};

    struct Scripted {
        boot_ms: AtomicI64,
        utc_ms: AtomicI64,
        state: ClockState,
    }

    impl Clock for Scripted {
        fn boot(&self) -> Duration {
            Duration::from_millis(u64::try_from(self.boot_ms.load(Ordering::SeqCst)).unwrap())
        }
        fn utc(&self) -> (i64, ClockState) {
            (self.utc_ms.load(Ordering::SeqCst) * 1_000_000, self.state)
        }
        fn sleep_until(&self, _: Duration) {}
    }

    #[test]
    fn a_stamp_has_the_wall_time_of_its_event_not_of_the_stamping() {
        let clock = Scripted {
            boot_ms: 5_020.into(),
            utc_ms: 1_700_000_000_020.into(),
            state: ClockState::Unsynced,
        };
        let stamp = Stamper::default().stamp(Duration::from_millis(5_000), &clock);
        let expected = Stamp {
            t_boot_ns: 5_000_000_000,
            t_utc_ns: 1_700_000_000_000_000_000,
            clock: ClockState::Unsynced,
        };
        assert_eq!(stamp, expected);
    }

    /// A host that is kept from running each time it has looked at the wall clock, so often and so long.
    struct HeldUp {
        boot_ms: AtomicI64,
        times: AtomicI64,
        ms: i64,
    }

    impl Clock for HeldUp {
        fn boot(&self) -> Duration {
            Duration::from_millis(u64::try_from(self.boot_ms.load(Ordering::SeqCst)).unwrap())
        }
        fn utc(&self) -> (i64, ClockState) {
            let utc_ms = 1_700_000_000_000 + self.boot_ms.load(Ordering::SeqCst);
            if self.times.fetch_sub(1, Ordering::SeqCst) > 0 {
                self.boot_ms.fetch_add(self.ms, Ordering::SeqCst);
            }
            (utc_ms * 1_000_000, ClockState::Synced)
        }
        fn sleep_until(&self, _: Duration) {}
    }

    #[test]
    fn a_host_held_up_between_its_clocks_stamps_no_other_time_and_sees_no_step() {
        // Once for a moment, once for a night's suspend, and again and again.
        for (times, ms, away_ms) in [
            (1, 300, 0),
            (1, 28_800_000, 0),
            (3, 300, 0),
            (i64::MAX, 300, 150),
        ] {
            let clock = HeldUp {
                boot_ms: 5_000.into(),
                times: 0.into(),
                ms,
            };
            let mut stamper = Stamper::default();
            stamper.stamp(clock.boot(), &clock);
            clock.times.store(times, Ordering::SeqCst);
            for _ in 0..3 {
                let at = clock.boot();
                let stamp = stamper.stamp(at, &clock);
                assert_eq!(stamp.clock, ClockState::Synced, "{times} times {ms} ms");
                let true_ms = 1_700_000_000_000 + i64::try_from(at.as_millis()).unwrap();
                let found_ms = stamp.t_utc_ns / 1_000_000;
                assert!(
                    (found_ms - true_ms).abs() <= away_ms,
                    "{found_ms} {true_ms}"
                );
            }
        }
    }

    #[test]
    fn a_set_clock_is_marked_once_and_a_slewed_one_never() {
        let clock = Scripted {
            boot_ms: 0.into(),
            utc_ms: 0.into(),
            state: ClockState::Synced,
        };
        let mut stamper = Stamper::default();
        let mut state_at = |boot_ms: i64, utc_ms: i64| {
            clock.boot_ms.store(boot_ms, Ordering::SeqCst);
            clock.utc_ms.store(utc_ms, Ordering::SeqCst);
            stamper.stamp(clock.boot(), &clock).clock
        };
        assert_eq!(state_at(100, 1_000_100), ClockState::Synced);
        assert_eq!(state_at(200, 1_000_201), ClockState::Synced);
        assert_eq!(state_at(300, 9_000_300), ClockState::Stepped);
        assert_eq!(state_at(400, 9_000_400), ClockState::Synced);
        assert_eq!(state_at(500, 1_000_500), ClockState::Stepped);
    }
}
