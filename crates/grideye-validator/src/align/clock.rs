//! The clock from recording time to scene time, and its bounds.

use crate::constants::BEYOND;

/// scene = recording + shift + rate * (recording - origin), seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clock {
    pub(crate) shift_s: f64,
    pub(crate) rate: f64,
    pub(crate) origin_s: f64,
}

impl Clock {
    /// The recording's own.
    pub(crate) const fn own() -> Self {
        Self::new(0.0, 0.0, 0.0)
    }

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

    pub(crate) fn excess_s(&self, clock: &Clock) -> f64 {
        clock.shift_s.abs() - self.shift_max_s
    }

    pub(crate) fn rate_excess(&self, clock: &Clock) -> f64 {
        clock.rate.abs() - self.rate_max
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_searched_further_than_they_reach() {
        let bounds = Bounds {
            origin_s: 3.0,
            shift_max_s: 0.5,
            rate_max: 0.1,
        };
        let wider = bounds.wider();
        assert_eq!((wider.origin_s, wider.shift_max_s), (3.0, 0.8));
        assert!((wider.rate_max - 0.16).abs() < 1e-12);
        let clock = |shift_s, rate| Clock::new(shift_s, rate, 3.0);
        assert_eq!(bounds.excess_s(&clock(-0.75, 0.0)), 0.25);
        assert_eq!(bounds.excess_s(&clock(0.25, 0.0)), -0.25);
        assert!((bounds.rate_excess(&clock(0.0, -0.15)) - 0.05).abs() < 1e-12);
    }
}
