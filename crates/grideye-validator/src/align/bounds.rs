//! How far a delay and a clock rate may go.

use crate::align::clock::{Law, Line};

/// Bounds of shift and rate, and where the recording begins, in seconds of the scene.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    pub(crate) origin_s: f64,
    pub(crate) shift_max_s: f64,
    pub(crate) rate_max: f64,
}

impl Bounds {
    /// Wide enough to see whether the best lies beyond.
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

    /// Whether a law would have its walk begin or end further away.
    pub(crate) fn holds_back(&self, law: &Law) -> bool {
        let most_s = LAW_WITHIN * self.shift_max_s;
        most_s > 0.0 && law.begins_late_s.abs().min(law.ends_late_s.abs()) > most_s
    }
}

/// The bounds are searched so much further than they reach.
pub(crate) const BEYOND: f64 = 1.6;
/// A law both of whose ends are at more than this share of their bound is held back by it.
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
        let line = |shift_s, rate| Line {
            shift_s,
            rate,
            origin_s: 3.0,
        };
        assert_eq!(bounds.excess_s(&line(-0.75, 0.0)), 0.25);
        assert_eq!(bounds.excess_s(&line(0.25, 0.0)), -0.25);
        assert!((bounds.rate_excess(&line(0.0, -0.15)) - 0.05).abs() < 1e-12);
        // Both ends at more than 98 % of the half second.
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
