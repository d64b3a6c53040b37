//! The sensor's update times, as proven bounds rather than guesses.
//!
//! Each update has an interval: it was not there yet when the registers still showed the old frame, and it was there
//! when they showed the new one. Intervals of earlier updates bound the period; the period and the last interval bound
//! the next update. So "surely before", "surely after" and "cannot tell" are three answers, and the count of frames
//! rests on the first two only.

use std::collections::VecDeque;

/// Nanoseconds of the boot clock, signed for differences.
pub(super) type Ns = i64;

/// The sensor's clock is assumed to be within this of nominal, in percent; 4 % was measured, 6 % is promised.
pub(super) const CLOCK_ERROR_MAX_PERCENT: Ns = 8;

/// How many recent updates bound the period; [`LANDMARKS`] adds some earlier ones.
const HISTORY_FRAMES: usize = 32;

/// Earlier updates, one per [`LANDMARK_EVERY`] frames: 51 s at 10 Hz. Over longer times, drift bounds the period
/// instead.
const LANDMARKS: usize = 16;
const LANDMARK_EVERY: u64 = 32;

/// How fast the sensor's period may change, in parts per million per second: 1 % per minute, more than warming up
/// causes.
const DRIFT_PPM_PER_S: Ns = 150;

/// How far a single update may deviate from the rhythm: the granularity of both clocks.
const JITTER_NS: Ns = 50_000;

const NS_PER_S: Ns = 1_000_000_000;

/// An update happened after `after`, and no later than `until`.
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

    /// The bounds for a sensor not yet observed.
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

    /// Adds half the drift of `ns`: turns the present period into the mean of the next `ns`, or the mean of the last
    /// `ns` into the period at its end.
    fn of_mean(self, ns: Ns) -> Self {
        self.widened(ns / 2)
    }
    fn widened(self, ns: Ns) -> Self {
        // Microseconds are precise enough for drift, and keep the product within the type.
        let ppm_us = (self.max / 1_000_000 * DRIFT_PPM_PER_S).saturating_mul(ns / 1_000 + 1);
        let drift = ppm_us / (NS_PER_S / 1_000) + 1;
        Self::new(self.min - drift, self.max + drift)
    }
}

/// An observation outside the bounds: the sensor restarted, or its clock jumped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct OutOfStep;

/// One sensor's phase: its latest update, its period, and the windows of the next updates.
#[derive(Debug, Clone)]
pub(super) struct Phase {
    nominal: Period,
    pub(super) period: Period,
    /// The latest frame with a bounded update.
    pub(super) seq: u64,
    window: Window,
    history: VecDeque<(u64, Window)>,
    landmarks: VecDeque<(u64, Window)>,
}

impl Phase {
    /// Starts from the first bounded update, that of frame `seq`.
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

    /// The window of the update of frame `seq`, which must not precede the latest frame.
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

    /// The earliest update of frame `seq`, given that the update of frame `of` (not later) came after `not_yet`.
    pub(super) fn earliest(&self, seq: u64, (of, not_yet): (u64, Ns)) -> Ns {
        let frames = frames_between(of, seq);
        let behind = match frames {
            0 => 0,
            frames => frames.saturating_mul(self.period.min) - JITTER_NS,
        };
        self.window(seq).after.max(not_yet + behind)
    }

    /// Advances to frame `seq`, with its update `seen` within these bounds, or not seen because the frame equals the
    /// one before. If no update can lie there, the phase stays unchanged.
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

    /// No clock drifts beyond its assumed tolerance.
    fn drifting(&self, period: Period) -> Period {
        period.intersect(self.nominal).unwrap_or(period)
    }

    /// The period's bounds from the remembered intervals and this newest one.
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
        /// The next update lies within its window for every sensor clock within tolerance, however coarsely updates are
        /// observed.
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
    fn an_impossible_update_is_out_of_step_and_changes_nothing() {
        let mut phase = Phase::new(100 * MS, 0, Window::new(0, MS));
        let before = phase.window(1);
        let early = Window::new(50 * MS, 60 * MS);
        assert_eq!(phase.advance(1, Some(early)), Err(OutOfStep));
        assert_eq!(phase.window(1), before);
    }
}
