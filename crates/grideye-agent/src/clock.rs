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
        let now = clock_gettime(ClockId::Realtime);
        let utc_ns = now.tv_sec.saturating_mul(1_000_000_000);
        let utc_ns = utc_ns.saturating_add(now.tv_nsec);
        if now.tv_sec >= EARLIEST_PLAUSIBLE_UTC_S && self.has_been_set() {
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

/// Stamps the records of one stream, and detects a wall clock set between two of them.
#[derive(Debug, Default)]
pub(crate) struct Stamper {
    /// Wall time minus boot time at the previous record, in nanoseconds.
    offset_ns: Option<i64>,
}

impl Stamper {
    /// The stamp of an event at `at` on the boot clock, shortly ago.
    pub(crate) fn stamp(&mut self, at: Duration, clock: &dyn Clock) -> Stamp {
        let (utc_ns, state) = clock.utc();
        let offset_ns = utc_ns.saturating_sub(signed_ns(clock.boot()));
        let moved_ns = offset_ns.saturating_sub(self.offset_ns.unwrap_or(offset_ns));
        self.offset_ns = Some(offset_ns);
        let has_moved = moved_ns.unsigned_abs() > unsigned_ns(STEP_MIN);
        Stamp {
            t_boot_ns: unsigned_ns(at),
            t_utc_ns: signed_ns(at).saturating_add(offset_ns),
            clock: match state {
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
