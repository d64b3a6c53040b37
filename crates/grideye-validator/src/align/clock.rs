//! Clocks from recording time to scene time (a line, a law of pace, or a path around a line), and their bounds.

use crate::numbers::{count, interpolated};
use serde::Serialize;

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Clock {
    Line(Line),
    Law(Law),
    Warp(Line, Warp),
}

impl Clock {
    pub(crate) const fn own() -> Self {
        Self::Line(Line::new(0.0, 0.0, 0.0))
    }

    pub(crate) fn scene_s(&self, time_s: f64) -> f64 {
        match self {
            Self::Line(line) => line.scene_s(time_s),
            Self::Law(law) => law.scene_s(time_s),
            Self::Warp(line, warp) => line.scene_s(time_s) + warp.by_s(time_s),
        }
    }
}

/// scene = recording + shift + rate * (recording - origin), seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    pub(crate) shift_s: f64,
    pub(crate) rate: f64,
    pub(crate) origin_s: f64,
}

impl Line {
    pub(crate) const fn new(shift_s: f64, rate: f64, origin_s: f64) -> Self {
        Self {
            shift_s,
            rate,
            origin_s,
        }
    }

    pub(crate) fn scene_s(self, time_s: f64) -> f64 {
        time_s + self.shift_s + self.rate * (time_s - self.origin_s)
    }
}

/// A law of pace: `scene = first + length * g(u)`, `g(u) = (1 - ease) u + ease (10 u^3 - 15 u^4 + 6 u^5) + lean u (1 -
/// u)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Law {
    /// How much later the walk begins than in the scene, seconds.
    pub begins_late_s: f64,
    /// How much later it ends than in the scene, seconds.
    pub ends_late_s: f64,
    /// -1 to 1: at 1, a constant scene speed starts and stops as smoothly as minimum jerk.
    pub ease: f64,
    /// -1 to 1: above 0, faster than the scene in the first half and slower in the second.
    pub lean: f64,
    #[serde(skip)]
    pub(crate) scene_s: (f64, f64),
}

impl Law {
    /// Scene time at a recording time; outside the walk both run at the same pace.
    pub(crate) fn scene_s(&self, time_s: f64) -> f64 {
        let (first_s, last_s) = self.scene_s;
        let (begin_s, end_s) = (first_s + self.begins_late_s, last_s + self.ends_late_s);
        if time_s < begin_s {
            return first_s + time_s - begin_s;
        }
        if time_s > end_s {
            return last_s + time_s - end_s;
        }
        let part = (time_s - begin_s) / (end_s - begin_s).max(f64::MIN_POSITIVE);
        first_s + (last_s - first_s) * self.profile(part)
    }

    pub(crate) fn profile(&self, u: f64) -> f64 {
        let smooth = u * u * u * (10.0 + u * (6.0 * u - 15.0));
        (1.0 - self.ease) * u + self.ease * smooth + self.lean * u * (1.0 - u)
    }

    /// Whether scene time never runs back.
    pub(crate) fn rises(&self) -> bool {
        const PARTS: usize = 40;
        let at = |part: usize| self.profile(count(part) / count(PARTS));
        (0..PARTS).all(|part| at(part + 1) >= at(part))
    }
}

/// A path in time: departure of scene time from the line, at recording times.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Warp {
    /// Recording time and departure, both in seconds, in order of time.
    #[serde(rename = "knots_s")]
    pub knots: Vec<(f64, f64)>,
}

impl Warp {
    /// Largest departure, seconds.
    #[must_use]
    pub fn departure_max_s(&self) -> f64 {
        self.knots
            .iter()
            .map(|(_, by_s)| by_s.abs())
            .fold(0.0, f64::max)
    }

    /// Departure at a recording time, seconds; constant beyond the knots.
    pub(crate) fn by_s(&self, time_s: f64) -> f64 {
        interpolated(&self.knots, time_s)
    }
}

/// Bounds of shift and rate; the origin is the scene time at which the recording begins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    pub(crate) origin_s: f64,
    pub(crate) shift_max_s: f64,
    pub(crate) rate_max: f64,
}

impl Bounds {
    pub(crate) fn wider(&self) -> Self {
        Self {
            shift_max_s: BEYOND * self.shift_max_s,
            rate_max: BEYOND * self.rate_max,
            ..*self
        }
    }

    pub(crate) fn excess_s(&self, line: &Line) -> f64 {
        line.shift_s.abs() - self.shift_max_s
    }

    pub(crate) fn rate_excess(&self, line: &Line) -> f64 {
        line.rate.abs() - self.rate_max
    }

    /// Whether both ends of a law are pressed against their bound.
    pub(crate) fn holds_back(&self, law: &Law) -> bool {
        let most_s = LAW_WITHIN * self.shift_max_s;
        most_s > 0.0 && law.begins_late_s.abs().min(law.ends_late_s.abs()) > most_s
    }
}

/// The search reaches this many times as far as the bounds.
pub(crate) const BEYOND: f64 = 1.6;
/// An end beyond this share of its bound is pressed against it.
const LAW_WITHIN: f64 = 0.98;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_searched_further_than_they_reach_and_hold_back_what_is_beyond() {
        let bounds = Bounds {
            origin_s: 3.0,
            shift_max_s: 0.5,
            rate_max: 0.1,
        };
        let wider = bounds.wider();
        assert_eq!((wider.origin_s, wider.shift_max_s), (3.0, 0.8));
        assert!((wider.rate_max - 0.16).abs() < 1e-12);
        let line = |shift_s, rate| Line::new(shift_s, rate, 3.0);
        assert_eq!(bounds.excess_s(&line(-0.75, 0.0)), 0.25);
        assert_eq!(bounds.excess_s(&line(0.25, 0.0)), -0.25);
        assert!((bounds.rate_excess(&line(0.0, -0.15)) - 0.05).abs() < 1e-12);
        // Both ends beyond 98 % of the half second.
        let law = |begins_late_s, ends_late_s| Law {
            begins_late_s,
            ends_late_s,
            ease: 0.0,
            lean: 0.0,
            scene_s: (0.0, 10.0),
        };
        assert!(bounds.holds_back(&law(-0.5, 0.495)));
        assert!(!bounds.holds_back(&law(-0.5, 0.48)));
        assert!(!bounds.holds_back(&law(0.3, 0.5)));
        let none = Bounds {
            shift_max_s: 0.0,
            ..bounds
        };
        assert!(!none.holds_back(&law(0.1, 0.1)));
    }
}
