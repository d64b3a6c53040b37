//! Where the sensor's moments of update lie, as bounds that hold and not as a guess.
//!
//! What is known of an update is an interval: it was not yet there when the registers still held the old frame, and it
//! was there when they held the new one. Known intervals of earlier updates bound the period, and period and last
//! interval bound the next update. So "surely before", "surely after" and "cannot say" are three answers, and the
//! count of frames rests on the first two only.

use std::collections::VecDeque;

/// Nanoseconds of the boot clock, signed for differences.
pub(super) type Ns = i64;

/// The sensor's clock is taken to be within this of nominal, in per cent; 4 % were measured, 6 % are promised.
pub(super) const CLOCK_ERROR_MAX_PERCENT: Ns = 8;

/// The latest updates whose intervals bound the period, and of the earlier ones every so many.
const HISTORY_FRAMES: usize = 32;

/// Earlier updates, one in [`HISTORY_FRAMES`]: 51 s at 10 Hz. Over longer times the drift is what bounds the period.
const LANDMARKS: usize = 16;
const LANDMARK_EVERY: u64 = 32;

/// How fast the sensor's period may change, in parts per million and second: 1 % a minute, more than warming up does.
const DRIFT_PPM_PER_S: Ns = 150;

/// What a single update may be off the regular rhythm: the granularity of both clocks.
const JITTER_NS: Ns = 50_000;

const NS_PER_S: Ns = 1_000_000_000;

/// An update happened after `after`, and at `until` at the latest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Window {
    pub(super) after: Ns,
    pub(super) until: Ns,
}

impl Window {
    pub(super) fn new(after: Ns, until: Ns) -> Self {
        Self { after, until }
    }

    pub(super) fn width(self) -> Ns {
        self.until - self.after
    }

    pub(super) fn middle(self) -> Ns {
        self.after + self.width() / 2
    }

    fn intersect(self, other: Self) -> Option<Self> {
        let both = Self::new(self.after.max(other.after), self.until.min(other.until));
        (both.after < both.until).then_some(both)
    }
}
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Period {
    pub(super) min: Ns,
    pub(super) max: Ns,
}

impl Period {
    fn new(min: Ns, max: Ns) -> Self {
        Self { min, max }
    }

    /// All that is known of a sensor before it has been watched.
    pub(super) fn nominal(period: Ns) -> Self {
        let error = period / 100 * CLOCK_ERROR_MAX_PERCENT;
        Self::new(period - error, period + error)
    }

    pub(super) fn middle(self) -> Ns {
        self.min + (self.max - self.min) / 2
    }

    fn intersect(self, other: Self) -> Option<Self> {
        let both = Self::new(self.min.max(other.min), self.max.min(other.max));
        (both.min <= both.max).then_some(both)
    }

    /// The bounds of the mean of the next `ns`, or from the mean of the last `ns` those at their end: half of their drift.
    fn of_mean(self, ns: Ns) -> Self {
        self.widened(ns / 2)
    }
    fn widened(self, ns: Ns) -> Self {
        // Microseconds of drifting suffice, and keep the product within the type.
        let ppm_us = (self.max / 1_000_000 * DRIFT_PPM_PER_S).saturating_mul(ns / 1_000 + 1);
        let drift = ppm_us / (NS_PER_S / 1_000) + 1;
        Self::new(self.min - drift, self.max + drift)
    }
}

/// What was seen does not fit the bounds: the sensor restarted, or its clock jumped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct OutOfStep;

/// The phase of one sensor: its latest update, its period, and where the next updates lie.
#[derive(Debug, Clone)]
pub(super) struct Phase {
    nominal: Period,
    pub(super) period: Period,
    /// The latest frame whose update was bounded.
    pub(super) seq: u64,
    window: Window,
    history: VecDeque<(u64, Window)>,
    landmarks: VecDeque<(u64, Window)>,
}

impl Phase {
    /// From the first update that was bounded: that of frame `seq`.
    pub(super) fn new(nominal_period: Ns, seq: u64, window: Window) -> Self {
        let nominal = Period::nominal(nominal_period);
        Self {
            nominal,
            period: nominal,
            seq,
            window,
            history: VecDeque::from([(seq, window)]),
            landmarks: VecDeque::new(),
        }
    }

    /// Where the update of frame `seq` lies. Frames before the latest one are not asked for.
    pub(super) fn window(&self, seq: u64) -> Window {
        let frames = frames_between(self.seq, seq);
        if frames == 0 {
            return self.window;
        }
        let mean = self.drifting(self.period.of_mean(frames.saturating_mul(self.period.max)));
        Window::new(
            self.window.after + frames.saturating_mul(mean.min) - JITTER_NS,
            self.window.until + frames.saturating_mul(mean.max) + JITTER_NS,
        )
    }

    /// The earliest update of frame `seq`, if that of frame `of`, no later one, came after `not_yet`.
    pub(super) fn earliest(&self, seq: u64, (of, not_yet): (u64, Ns)) -> Ns {
        let frames = frames_between(of, seq);
        let behind = match frames {
            0 => 0,
            frames => frames.saturating_mul(self.period.min) - JITTER_NS,
        };
        self.window(seq).after.max(not_yet + behind)
    }

    /// Goes on to frame `seq`, whose update was `seen` within these bounds, or not seen because the frame looked like the one
    /// before. Where no update can lie there, the phase stays as it was.
    pub(super) fn advance(&mut self, seq: u64, seen: Option<Window>) -> Result<(), OutOfStep> {
        let predicted = self.window(seq);
        let window = match seen {
            Some(seen) => predicted.intersect(seen).ok_or(OutOfStep)?,
            None => predicted,
        };
        let frames = frames_between(self.seq, seq);
        let period = self.period_with(seq, window)?;
        let remembered = self.period.widened(frames.saturating_mul(self.period.max));
        self.period = remembered.intersect(period).unwrap_or(period);
        (self.seq, self.window) = (seq, window);
        self.remember(seq, window);
        Ok(())
    }

    fn remember(&mut self, seq: u64, window: Window) {
        if self.history.len() == HISTORY_FRAMES {
            let oldest = self.history.pop_front();
            let is_due =
                |(last, _): &(u64, Window)| seq.saturating_sub(*last) >= 2 * LANDMARK_EVERY;
            if self.landmarks.back().is_none_or(is_due) {
                self.landmarks.extend(oldest);
            }
            if self.landmarks.len() > LANDMARKS {
                self.landmarks.pop_front();
            }
        }
        self.history.push_back((seq, window));
    }

    /// No clock drifts out of what it is taken to be within.
    fn drifting(&self, period: Period) -> Period {
        period.intersect(self.nominal).unwrap_or(period)
    }

    /// What the intervals remembered and this newest one say of the period.
    fn period_with(&self, seq: u64, window: Window) -> Result<Period, OutOfStep> {
        let mut period = self.nominal;
        for (earlier, then) in self.landmarks.iter().chain(&self.history) {
            let frames = frames_between(*earlier, seq);
            if frames == 0 {
                continue;
            }
            let mean = Period::new(
                (window.after - then.until - JITTER_NS) / frames,
                (window.until - then.after + JITTER_NS) / frames + 1,
            );
            let now = mean.of_mean(frames.saturating_mul(self.nominal.max));
            period = period.intersect(now).ok_or(OutOfStep)?;
        }
        Ok(period)
    }
}

fn frames_between(earlier: u64, later: u64) -> Ns {
    Ns::try_from(later.saturating_sub(earlier)).unwrap_or(Ns::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: Ns = 1_000_000;

    proptest! {
        /// The bounds hold: whatever the sensor's clock within its tolerance, and however coarsely updates are seen,
        /// the next update lies within its window.
        #[test]
        fn the_next_update_lies_within_its_window(
            error_ppm in -60_000_i64..60_000,
            drift_ppm_per_s in -30_i64..30,
            coarseness in prop::collection::vec((0_i64..40 * MS, 1_i64..40 * MS, prop::bool::weighted(0.8)), 300),
        ) {
            let period_at = |t: Ns| {
                let drift = drift_ppm_per_s * (t / MS) / 1_000;
                100 * MS + (error_ppm + drift) * 100
            };
            let mut update = 0;
            let mut phase = Phase::new(100 * MS, 0, Window::new(-30 * MS, 10 * MS));
            for (seq, (before, behind, is_seen)) in (1..).zip(coarseness) {
                update += period_at(update);
                let window = phase.window(seq);
                prop_assert!(window.after < update && update <= window.until, "{seq}: {window:?} {update}");
                let seen = Window::new(update - before - 1, update + behind);
                prop_assert_eq!(phase.advance(seq, is_seen.then_some(seen)), Ok(()));
            }
            let period = phase.period;
            prop_assert!(period.min <= period_at(update) && period_at(update) <= period.max);
            prop_assert!(period.max - period.min < 6 * MS);
        }
    }

    #[test]
    fn an_update_where_none_can_be_is_out_of_step_and_changes_nothing() {
        let mut phase = Phase::new(100 * MS, 0, Window::new(0, MS));
        let before = phase.window(1);
        let early = Window::new(50 * MS, 60 * MS);
        assert_eq!(phase.advance(1, Some(early)), Err(OutOfStep));
        assert_eq!(phase.window(1), before);
    }
}
