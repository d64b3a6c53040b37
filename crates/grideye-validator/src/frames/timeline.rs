//! Where a recording lies on a scene's time axis: the one place that decides it.

use grideye_recording::{ClockState, Record};
use grideye_scene::{Scene, Utc};
use std::time::Duration;

/// The scene's time on the device's boot clock, which neither steps nor runs back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timeline {
    from_ns: u64,
    /// The scene's time when the boot clock is `from_ns`; below zero before the scene's start.
    scene_ns: i128,
    joined: Joined,
}

/// How recording and scene were joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Joined {
    /// The recording's first frame, or a given moment of the boot clock, is at a given time of the scene.
    Given,
    /// By UTC: the scene has a start in UTC, and the device's clock was set.
    Utc,
    /// As if the scene had no UTC: the device's clock was never set, so the first frame is the scene's start.
    ClockNeverSet,
}

/// A recording and a scene in UTC that share no moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the recording lasts from {} to {} and the scene from {} to {}, so they share no moment\nhint: use the recording of that walk; if it is, correct the clock or time zone of the trajectory's utc, or give t_s instead to count from the first frame", .recording[0], .recording[1], .scene[0], .scene[1]
)]
pub struct Apart {
    /// First and last frame.
    pub recording: [Utc; 2],
    /// Start and end.
    pub scene: [Utc; 2],
}

impl Timeline {
    /// With `start_s` at the first frame, which is below zero before the scene's start; without it by UTC where both sides
    /// know it, else from the first frame.
    ///
    /// # Errors
    /// [`Apart`] if joined by UTC without a common moment.
    pub fn new(records: &[Record], scene: &Scene, start_s: Option<f64>) -> Result<Self, Apart> {
        let is_read = |record: &&Record| record.reading.frame().is_some();
        let mut read = records.iter().filter(is_read);
        let from_ns = read.next().map_or(0, |record| record.stamp.t_boot_ns);
        let given = Self {
            from_ns,
            scene_ns: start_s.map_or(0, signed_nanoseconds),
            joined: Joined::Given,
        };
        let starts_utc = scene.starts_utc().filter(|_| !scene.is_static());
        let (None, Some(starts)) = (start_s, starts_utc) else {
            return Ok(given);
        };
        let Some(wall_ns) = wall_less_boot_ns(records) else {
            let joined = Joined::ClockNeverSet;
            return Ok(Self { joined, ..given });
        };
        let last_ns = read
            .next_back()
            .map_or(from_ns, |record| record.stamp.t_boot_ns);
        let utc = |boot_ns: u64| i128::from(boot_ns) + wall_ns;
        let first_utc = utc(from_ns);
        let ends = i128::from(starts.ns) + nanoseconds(scene.duration());
        if utc(last_ns) < i128::from(starts.ns) || ends < first_utc {
            let [first, last, ends] = [first_utc, utc(last_ns), ends].map(moment);
            return Err(Apart {
                recording: [first, last],
                scene: [starts, ends],
            });
        }
        Ok(Self {
            scene_ns: first_utc - i128::from(starts.ns),
            joined: Joined::Utc,
            ..given
        })
    }

    /// With the scene's start at a moment of the boot clock.
    #[must_use]
    pub const fn from_boot(origin_ns: u64) -> Self {
        Self {
            from_ns: origin_ns,
            scene_ns: 0,
            joined: Joined::Given,
        }
    }

    /// How recording and scene were joined.
    #[must_use]
    pub const fn joined(&self) -> Joined {
        self.joined
    }

    /// The scene's time at a moment of the boot clock; `None` before the scene's start.
    #[must_use]
    pub fn time(&self, boot_ns: u64) -> Option<Duration> {
        duration(self.scene_ns + i128::from(boot_ns) - i128::from(self.from_ns))
    }

    /// The boot clock at the scene's start; below zero if the device started later, `None` beyond 64 bits.
    #[must_use]
    pub fn origin_ns(&self) -> Option<i64> {
        i64::try_from(i128::from(self.from_ns) - self.scene_ns).ok()
    }

    /// The scene's time at the recording's first frame, seconds; below zero before the scene's start.
    pub(crate) fn start_s(&self) -> f64 {
        let before = duration(-self.scene_ns).unwrap_or_default();
        self.start().as_secs_f64() - before.as_secs_f64()
    }

    /// The scene's time at the recording's first frame, or its start if that is later.
    pub(crate) fn start(&self) -> Duration {
        duration(self.scene_ns).unwrap_or_default()
    }

    /// Time since the recording's first frame at a time of the scene.
    pub(crate) fn since_first(&self, time: Duration) -> Duration {
        duration(nanoseconds(time) - self.scene_ns).unwrap_or_default()
    }
}

/// Median of wall less boot clock over the records with a set clock, so that one step does not move the recording.
fn wall_less_boot_ns(records: &[Record]) -> Option<i128> {
    let set = records.iter().map(|record| record.stamp);
    let set = set.filter(|stamp| stamp.clock == ClockState::Synced);
    let mut leads: Vec<i128> = set
        .map(|stamp| i128::from(stamp.t_utc_ns) - i128::from(stamp.t_boot_ns))
        .collect();
    let middle = leads.len() / 2;
    (!leads.is_empty()).then(|| *leads.select_nth_unstable(middle).1)
}

fn nanoseconds(time: Duration) -> i128 {
    i128::try_from(time.as_nanos()).unwrap_or(i128::MAX)
}

/// 0 for what is no time.
fn signed_nanoseconds(seconds: f64) -> i128 {
    let ns = Duration::try_from_secs_f64(seconds.abs()).map_or(0, nanoseconds);
    if seconds < 0.0 { -ns } else { ns }
}

fn duration(ns: i128) -> Option<Duration> {
    const NS_PER_S: u128 = 1_000_000_000;
    let ns = u128::try_from(ns).ok()?;
    let seconds = u64::try_from(ns / NS_PER_S).unwrap_or(u64::MAX);
    Some(Duration::new(seconds, u32::try_from(ns % NS_PER_S).ok()?))
}

fn moment(ns: i128) -> Utc {
    let end = if ns < 0 { i64::MIN } else { i64::MAX };
    Utc {
        ns: i64::try_from(ns).unwrap_or(end),
    }
}
