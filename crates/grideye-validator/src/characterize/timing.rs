//! Timing of frames: rate, stalls and clock jumps.

use crate::constants::{JUMP_MIN_NS, STALL_PERIODS};
use crate::numbers::{long_count, whole};
use grideye_recording::{ClockState, Stamp};
use serde::Serialize;
use std::collections::BTreeMap;

/// Wall clock jumps listed; later ones are only counted.
pub const JUMPS_LISTED_MAX: usize = 16;
/// Ratio between bins of intervals: 0.1 %.
const BIN_RATIO: f64 = 1.001;
/// An interval within these multiples of the median counts for the rate.
const PERIODS: (f64, f64) = (0.5, 1.5);
const NANOSECONDS_PER_SECOND: f64 = 1e9;
/// Intervals before a stall can break the sequence.
const INTERVALS_MIN: u64 = 10;

/// Timing of a recording's frames.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Timing {
    /// From first to last frame by the boot clock, seconds.
    pub span_s: f64,
    /// Frame rate without stalls, Hz: from intervals of 0.5 to 1.5 medians; 0 if there is none.
    pub rate_hz: f64,
    pub period_s: f64,
    pub longest_s: f64,
    /// Intervals longer than 2.5 medians without a frame recorded as missing.
    pub stalls: u64,
    /// Jumps of the wall clock against the boot clock.
    pub jumps: u64,
    /// The first [`JUMPS_LISTED_MAX`] of them.
    pub listed_jumps: Vec<Jump>,
}

/// A jump of the wall clock.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Jump {
    /// The frame after the jump.
    pub seq: u64,
    /// Advance of the wall clock, seconds, less that of the boot clock where known.
    pub by_s: f64,
}

#[derive(Debug, Default)]
pub(crate) struct Times {
    first_ns: Option<u64>,
    last: Option<Stamp>,
    bins: BTreeMap<i32, Bin>,
    intervals: u64,
    typical_s: f64,
    /// Holds the span, the longest interval and the jumps.
    found: Timing,
}

#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    count: u64,
    sum_s: f64,
}

impl Bin {
    fn mean_s(&self) -> f64 {
        self.sum_s / long_count(self.count)
    }
}

impl Times {
    /// `follows`: directly after the last. Returns whether a gap, a stall or a stepped clock breaks the sequence.
    pub(crate) fn push(&mut self, seq: u64, stamp: &Stamp, follows: bool) -> bool {
        let begin_ns = *self.first_ns.get_or_insert(stamp.t_boot_ns);
        let since_ns = i128::from(stamp.t_boot_ns) - i128::from(begin_ns);
        self.found.span_s = self.found.span_s.max(seconds(since_ns));
        let Some(last) = self.last.replace(*stamp) else {
            return false;
        };
        let jumped = self.look_for_jump(seq, &last, stamp);
        let interval_ns = i128::from(stamp.t_boot_ns) - i128::from(last.t_boot_ns);
        if !follows || interval_ns <= 0 || (jumped && stamp.clock == ClockState::Stepped) {
            return true;
        }
        self.take_interval(seconds(interval_ns))
    }

    pub(crate) fn finish(self) -> Timing {
        let period_s = self.median_s();
        let periods = PERIODS.0 * period_s..=PERIODS.1 * period_s;
        let counted = self.sum(|interval_s| periods.contains(&interval_s));
        Timing {
            rate_hz: match counted.count {
                0 => 0.0,
                _ => 1.0 / counted.mean_s(),
            },
            period_s,
            stalls: self.sum(|by_s| by_s > STALL_PERIODS * period_s).count,
            ..self.found
        }
    }

    fn look_for_jump(&mut self, seq: u64, last: &Stamp, stamp: &Stamp) -> bool {
        let wall_ns = i128::from(stamp.t_utc_ns) - i128::from(last.t_utc_ns);
        let boot_ns = i128::from(stamp.t_boot_ns) - i128::from(last.t_boot_ns);
        // Where the wall clock was set, an import without a boot clock made up this interval.
        let by_ns = match stamp.clock {
            ClockState::Stepped => wall_ns,
            ClockState::Unsynced | ClockState::Synced => wall_ns - boot_ns,
        };
        let jumped = by_ns.abs() >= JUMP_MIN_NS;
        if jumped {
            self.found.jumps += 1;
            if self.found.listed_jumps.len() < JUMPS_LISTED_MAX {
                let by_s = seconds(by_ns);
                self.found.listed_jumps.push(Jump { seq, by_s });
            }
        }
        jumped
    }

    fn take_interval(&mut self, interval_s: f64) -> bool {
        let stalled =
            self.intervals >= INTERVALS_MIN && interval_s > STALL_PERIODS * self.typical_s;
        let bin = self
            .bins
            .entry(whole((interval_s.ln() / BIN_RATIO.ln()).floor()))
            .or_default();
        bin.count += 1;
        bin.sum_s += interval_s;
        self.intervals += 1;
        self.found.longest_s = self.found.longest_s.max(interval_s);
        // The median changes little, and searching it each time would cost more than everything else.
        if self.intervals.is_power_of_two() || self.intervals % 1024 == 0 {
            self.typical_s = self.median_s();
        }
        stalled
    }

    fn median_s(&self) -> f64 {
        let wanted = 0.5 * long_count(self.intervals);
        let mut below = 0.0;
        for bin in self.bins.values() {
            below += long_count(bin.count);
            if below >= wanted {
                return bin.mean_s();
            }
        }
        0.0
    }

    fn sum(&self, holds: impl Fn(f64) -> bool) -> Bin {
        let mut sum = Bin::default();
        for bin in self.bins.values().filter(|bin| holds(bin.mean_s())) {
            sum.count += bin.count;
            sum.sum_s += bin.sum_s;
        }
        sum
    }
}

#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "what a float loses of nanoseconds is less than any clock tells"
)]
fn seconds(nanoseconds: i128) -> f64 {
    nanoseconds as f64 / NANOSECONDS_PER_SECOND
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn stamp(t_boot_ms: u64, t_utc_ms: i64) -> Stamp {
        Stamp {
            t_boot_ns: t_boot_ms * MS,
            t_utc_ns: t_utc_ms * 1_000_000,
            clock: ClockState::Synced,
        }
    }

    fn push_at(times: &mut Times, at_ms: impl IntoIterator<Item = u64>) -> Vec<bool> {
        (0_u64..)
            .zip(at_ms)
            .map(|(seq, ms)| times.push(seq, &stamp(ms, i64::try_from(ms).unwrap()), seq > 0))
            .collect()
    }

    #[test]
    fn the_rate_leaves_stalls_and_bursts_out() {
        let mut times = Times::default();
        // 100 intervals of alternately 99 and 101 ms, a stall of 1.5 s, five frames 2 ms apart.
        let mut at = vec![0];
        (0..100).for_each(|i| at.push(at[at.len() - 1] + if i % 2 == 0 { 99 } else { 101 }));
        at.push(at[at.len() - 1] + 1500);
        (0..5).for_each(|_| at.push(at[at.len() - 1] + 2));
        let broken = push_at(&mut times, at);
        assert_eq!(broken.iter().filter(|broken| **broken).count(), 1);
        assert!(broken[101]);
        let timing = times.finish();
        assert!((timing.rate_hz - 10.0).abs() < 1e-9);
        assert_eq!((timing.stalls, timing.jumps), (1, 0));
        assert!((timing.longest_s - 1.5).abs() < 1e-12);
        assert!((timing.span_s - 11.51).abs() < 1e-9);
    }

    #[test]
    fn jumps_are_listed_up_to_a_limit_and_then_counted() {
        let mut times = Times::default();
        let jumps = u64::try_from(JUMPS_LISTED_MAX).unwrap() + 3;
        for seq in 0..=jumps {
            let back = i64::try_from(seq).unwrap() * -3000;
            times.push(seq, &stamp(seq * 100, back), seq > 0);
        }
        let timing = times.finish();
        assert_eq!(timing.jumps, jumps);
        assert_eq!(timing.listed_jumps.len(), JUMPS_LISTED_MAX);
        assert_eq!(timing.listed_jumps[0], Jump { seq: 1, by_s: -3.1 });
    }

    #[test]
    fn memory_is_bounded_by_the_ratio_of_the_bins() {
        let mut times = Times::default();
        let mut at_ns = 0;
        for seq in 0..20_000_u64 {
            at_ns += 1 + seq * seq * seq;
            let mut at = stamp(0, 0);
            at.t_boot_ns = at_ns;
            times.push(seq, &at, seq > 0);
        }
        // From a nanosecond to 8000 s there are ln(8e12) / ln(1.001) = 29,700 bins.
        assert!(times.bins.len() < 29_800);
    }

    #[test]
    fn an_empty_recording_gives_no_nan() {
        let timing = Times::default().finish();
        assert_eq!((timing.rate_hz, timing.period_s), (0.0, 0.0));
    }
}
