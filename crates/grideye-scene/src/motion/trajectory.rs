//! The path of a walker, and the walker's position at any time.

use crate::motion::schedule::Schedule;
use glam::DVec3;
use std::time::Duration;

/// A polyline and the timing along it: constant speed by default (PeerJ CS 11:e3124, "Sensor sampling frequency"),
/// otherwise a schedule. At the end the walker stands still.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    waypoints_m: Vec<DVec3>,
    /// Arc length from the start to each waypoint.
    lengths_m: Vec<f64>,
    pace: Pace,
}

#[derive(Debug, Clone, PartialEq)]
enum Pace {
    Constant { speed_m_per_s: f64 },
    Schedule(Schedule),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Leg {
    pub(crate) start_s: f64,
    pub(crate) end_s: f64,
    /// Limit on the speed during the leg; 0 at a stop.
    pub(crate) speed_max_m_per_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stay {
    pub(crate) from_s: f64,
    /// Infinite at the end of the path.
    pub(crate) until_s: f64,
}

impl Trajectory {
    /// The polyline's points, meters.
    #[must_use]
    pub fn waypoints_m(&self) -> &[DVec3] {
        &self.waypoints_m
    }

    /// Time from the start of the scene to the last waypoint, including any stay there.
    #[must_use]
    pub fn duration(&self) -> Duration {
        // Parsing has refused longer times, so the fallback is never used.
        Duration::try_from_secs_f64(self.end_s()).unwrap_or(Duration::MAX)
    }

    /// The walker's position after `time`, meters.
    #[must_use]
    pub fn position_m(&self, time: Duration) -> DVec3 {
        self.at_s(time.as_secs_f64())
    }

    pub(crate) fn new(waypoints_m: Vec<DVec3>, speed_m_per_s: f64) -> Self {
        Self {
            lengths_m: lengths_m(&waypoints_m),
            waypoints_m,
            pace: Pace::Constant { speed_m_per_s },
        }
    }

    /// A path from its waypoints, their [`lengths_m`], and the schedule made from these.
    pub(crate) fn scheduled(
        waypoints_m: Vec<DVec3>,
        lengths_m: Vec<f64>,
        schedule: Schedule,
    ) -> Self {
        Self {
            waypoints_m,
            lengths_m,
            pace: Pace::Schedule(schedule),
        }
    }

    fn length_m(&self) -> f64 {
        self.lengths_m.last().copied().unwrap_or(0.0)
    }

    pub(crate) fn end_s(&self) -> f64 {
        match &self.pace {
            Pace::Constant { speed_m_per_s } => self.length_m() / speed_m_per_s,
            Pace::Schedule(schedule) => schedule.end_s,
        }
    }

    pub(crate) fn at_s(&self, time_s: f64) -> DVec3 {
        self.at_length_m(self.length_at_s(time_s))
    }

    /// The waypoint that the walker is approaching or has just reached, at a time in seconds.
    pub(crate) fn heads_for(&self, time_s: f64) -> usize {
        let length_m = self.length_at_s(time_s);
        let last = self.waypoints_m.len().saturating_sub(1);
        self.lengths_m
            .partition_point(|reached| *reached < length_m)
            .clamp(last.min(1), last)
    }

    /// The straight legs and the stops between them, in order of time.
    pub(crate) fn legs(&self) -> Vec<Leg> {
        let mut legs = Vec::new();
        let mut end_s = 0.0;
        let mut push = |until_s: f64, speed_max_m_per_s: f64| {
            if until_s > end_s {
                legs.push(Leg {
                    start_s: end_s,
                    end_s: until_s,
                    speed_max_m_per_s,
                });
                end_s = until_s;
            }
        };
        match &self.pace {
            Pace::Constant { speed_m_per_s } => {
                for length_m in &self.lengths_m {
                    push(length_m / speed_m_per_s, *speed_m_per_s);
                }
            }
            Pace::Schedule(schedule) => {
                for stretch in &schedule.stretches {
                    push(stretch.start_s, 0.0);
                    let (from_m, to_m) = (stretch.from_m, stretch.from_m + stretch.length_m);
                    let first = self.lengths_m.partition_point(|length| *length <= from_m);
                    let inner = self.lengths_m[first..].iter();
                    for length_m in inner.take_while(|length_m| **length_m < to_m) {
                        push(stretch.time_at(*length_m), stretch.speed_max_m_per_s());
                    }
                    push(stretch.end_s(), stretch.speed_max_m_per_s());
                }
                push(schedule.end_s, 0.0);
            }
        }
        legs
    }

    pub(crate) fn stays(&self) -> Vec<Stay> {
        let mut stays: Vec<Stay> = Vec::new();
        let mut still_since_s = 0.0;
        for leg in self.legs() {
            if leg.speed_max_m_per_s > 0.0 {
                if leg.start_s > still_since_s {
                    stays.push(Stay {
                        from_s: still_since_s,
                        until_s: leg.start_s,
                    });
                }
                still_since_s = leg.end_s;
            }
        }
        stays.push(Stay {
            from_s: still_since_s,
            until_s: f64::INFINITY,
        });
        stays
    }

    /// How far the walker has come, meters, and how fast it goes, m/s.
    pub(crate) fn pace_at_s(&self, time_s: f64) -> (f64, f64) {
        const AROUND_S: f64 = 0.05;
        let length_m = |time_s: f64| self.length_at_s(time_s).clamp(0.0, self.length_m());
        let ahead_m = length_m(time_s + AROUND_S) - length_m(time_s - AROUND_S);
        (length_m(time_s), ahead_m / (2.0 * AROUND_S))
    }

    fn length_at_s(&self, time_s: f64) -> f64 {
        match &self.pace {
            Pace::Constant { speed_m_per_s } => speed_m_per_s * time_s,
            Pace::Schedule(schedule) => schedule.length_m(time_s),
        }
    }

    fn at_length_m(&self, length_m: f64) -> DVec3 {
        let last = self.waypoints_m.len().saturating_sub(1);
        let next = self
            .lengths_m
            .partition_point(|reached| *reached <= length_m)
            .min(last);
        let before = next.saturating_sub(1);
        let leg_m = self.lengths_m[next] - self.lengths_m[before];
        let share = ((length_m - self.lengths_m[before]) / leg_m).clamp(0.0, 1.0);
        if leg_m > 0.0 && share < 1.0 {
            self.waypoints_m[before].lerp(self.waypoints_m[next], share)
        } else {
            self.waypoints_m[next]
        }
    }
}

pub(crate) fn lengths_m(waypoints_m: &[DVec3]) -> Vec<f64> {
    let mut lengths_m = Vec::with_capacity(waypoints_m.len());
    let mut length_m = 0.0;
    let mut previous = waypoints_m.first().copied().unwrap_or(DVec3::ZERO);
    for point in waypoints_m {
        length_m += previous.distance(*point);
        lengths_m.push(length_m);
        previous = *point;
    }
    lengths_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::limits::{self, TIME_MAX_S};

    fn corner() -> Trajectory {
        // 3 m along x, a point twice, 4 m along y, at 0.5 m/s: 14 s.
        let points = [
            [1.0, 1.0, 0.0],
            [4.0, 1.0, 0.0],
            [4.0, 1.0, 0.0],
            [4.0, 5.0, 0.0],
        ];
        Trajectory::new(points.map(DVec3::from_array).to_vec(), 0.5)
    }

    #[test]
    fn positions_follow_arc_length() {
        let walk = corner();
        assert_eq!(walk.length_m(), 7.0);
        assert_eq!(walk.duration(), Duration::from_secs(14));
        for (seconds, expected) in [
            (0.0, [1.0, 1.0, 0.0]),
            (1.0, [1.5, 1.0, 0.0]),
            (6.0, [4.0, 1.0, 0.0]),
            (7.0, [4.0, 1.5, 0.0]),
            (14.0, [4.0, 5.0, 0.0]),
            (1e6, [4.0, 5.0, 0.0]),
        ] {
            let found = walk.position_m(Duration::from_secs_f64(seconds));
            assert!(
                (found - DVec3::from_array(expected)).length() < 1e-12,
                "{seconds}: {found}"
            );
        }
        assert_eq!(walk.position_m(Duration::MAX), DVec3::new(4.0, 5.0, 0.0));
    }

    #[test]
    fn the_latest_time_is_the_longest_walk() {
        let longest = Duration::from_secs(86_400 * limits::WALK_DAYS_MAX);
        assert_eq!(Duration::from_secs_f64(TIME_MAX_S), longest);
    }

    #[test]
    fn a_single_waypoint_is_a_standing_walker() {
        let stand = Trajectory::new(vec![DVec3::ONE], 1.0);
        assert_eq!(stand.duration(), Duration::ZERO);
        assert_eq!(stand.position_m(Duration::from_secs(3)), DVec3::ONE);
        let twice = Trajectory::new(vec![DVec3::ONE, DVec3::ONE], 1.0);
        assert_eq!(twice.position_m(Duration::ZERO), DVec3::ONE);
    }
}
