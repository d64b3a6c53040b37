//! Timing of a walker over stretches of length `L` and time `T` between stops; `u` is the elapsed share of `T`.
//!
//! | motion | arc length covered | highest speed |
//! |---|---|---|
//! | constant | `L u` | `L / T` |
//! | trapezoidal, ramps of `r` seconds | speeds up at `v / r`, keeps `v`, slows down at `v / r` | `v = L / (T - r)` |
//! | minimum jerk (Flash and Hogan 1985) | `L (10 u³ - 15 u⁴ + 6 u⁵)` | `1.875 L / T` |

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Motion {
    Constant,
    /// Accelerate from rest, keep the speed, and slow down to rest at the same rate.
    Trapezoidal {
        acceleration_m_per_s2: f64,
    },
    /// From rest to rest with the least jerk.
    MinimumJerk,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Clock<'a> {
    /// Meters per second: the constant speed, the speed between the ramps of a trapezoid, or the mean over each
    /// minimum-jerk leg.
    Speed(f64),
    /// Arrival times at the waypoints, seconds, increasing.
    Stamps(&'a [f64]),
}

/// The part of a path between two stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stretch {
    pub(crate) start_s: f64,
    pub(crate) travel_s: f64,
    pub(crate) from_m: f64,
    pub(crate) length_m: f64,
    curve: SpeedCurve,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum SpeedCurve {
    Constant,
    Ramps { ramp_s: f64 },
    MinimumJerk,
}

/// The stretches of a path, and the time when the last stop ends.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Schedule {
    pub(crate) stretches: Vec<Stretch>,
    pub(crate) end_s: f64,
}

/// The waypoint, from 0, that cannot be reached in time at the given acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TooFast(pub(crate) usize);

impl Stretch {
    pub(crate) fn end_s(&self) -> f64 {
        self.start_s + self.travel_s
    }

    /// Arc length from the start of the path, meters, at a scene time.
    pub(crate) fn at_s(&self, time_s: f64) -> f64 {
        let passed_s = time_s - self.start_s;
        if passed_s >= self.travel_s {
            return self.from_m + self.length_m;
        }
        self.from_m + self.covered_m(passed_s.max(0.0))
    }

    /// The scene time when this arc length of the path is reached.
    pub(crate) fn time_at(&self, length_m: f64) -> f64 {
        let covered_m = (length_m - self.from_m).clamp(0.0, self.length_m);
        if self.length_m <= 0.0 {
            return self.start_s;
        }
        let passed_s = match self.curve {
            SpeedCurve::Constant => covered_m / self.length_m * self.travel_s,
            SpeedCurve::Ramps { ramp_s } => {
                let ramp_m = 0.5 * self.speed_max_m_per_s() * ramp_s;
                let by_ramp = |part_m: f64| ramp_s * (part_m / ramp_m).sqrt();
                let rest_m = self.length_m - covered_m;
                if covered_m < ramp_m {
                    by_ramp(covered_m)
                } else if rest_m < ramp_m {
                    self.travel_s - by_ramp(rest_m)
                } else {
                    covered_m / self.speed_max_m_per_s() + 0.5 * ramp_s
                }
            }
            // Minimum-jerk stretches are single legs, so only their ends are queried.
            SpeedCurve::MinimumJerk if covered_m < self.length_m => 0.0,
            SpeedCurve::MinimumJerk => self.travel_s,
        };
        self.start_s + passed_s
    }

    pub(crate) fn speed_max_m_per_s(&self) -> f64 {
        if self.travel_s <= 0.0 {
            return 0.0;
        }
        match self.curve {
            SpeedCurve::Constant => self.length_m / self.travel_s,
            SpeedCurve::Ramps { ramp_s } => self.length_m / (self.travel_s - ramp_s),
            SpeedCurve::MinimumJerk => 1.875 * self.length_m / self.travel_s,
        }
    }

    fn covered_m(&self, passed_s: f64) -> f64 {
        let share = passed_s / self.travel_s;
        match self.curve {
            SpeedCurve::Constant => self.length_m * share,
            SpeedCurve::MinimumJerk => {
                self.length_m * share * share * share * (10.0 + share * (-15.0 + 6.0 * share))
            }
            SpeedCurve::Ramps { ramp_s } => {
                let speed = self.speed_max_m_per_s();
                let left_s = self.travel_s - passed_s;
                if passed_s < ramp_s {
                    0.5 * speed * passed_s * passed_s / ramp_s
                } else if left_s < ramp_s {
                    self.length_m - 0.5 * speed * left_s * left_s / ramp_s
                } else {
                    speed * (passed_s - 0.5 * ramp_s)
                }
            }
        }
    }
}

impl Schedule {
    /// A path by arc length, with the seconds to stand at each waypoint. Constant motion does not rest at stamps.
    pub(crate) fn new(
        lengths_m: &[f64],
        dwells_s: &[f64],
        motion: Motion,
        clock: Clock<'_>,
    ) -> Result<Self, TooFast> {
        let dwell_s = |index: usize| dwells_s.get(index).copied().unwrap_or(0.0);
        let first_s = match clock {
            Clock::Speed(_) => 0.0,
            Clock::Stamps(times_s) => times_s.first().copied().unwrap_or(0.0),
        };
        let mut schedule = Self {
            stretches: Vec::new(),
            end_s: first_s + dwell_s(0),
        };
        let last = lengths_m.len().saturating_sub(1);
        let every_leg = motion == Motion::MinimumJerk || matches!(clock, Clock::Stamps(_));
        let mut from = 0;
        for to in 1..=last {
            if !every_leg && to < last && dwell_s(to) <= 0.0 {
                continue;
            }
            let start_s = schedule.end_s;
            let length_m = lengths_m[to] - lengths_m[from];
            let (travel_s, curve) = match clock {
                Clock::Speed(speed) => by_speed(motion, length_m, speed),
                Clock::Stamps(times_s) => {
                    by_time(motion, length_m, times_s[to] - start_s).ok_or(TooFast(to))?
                }
            };
            schedule.stretches.push(Stretch {
                start_s,
                travel_s,
                from_m: lengths_m[from],
                length_m,
                curve,
            });
            let arrival_s = match clock {
                Clock::Speed(_) => start_s + travel_s,
                Clock::Stamps(times_s) => times_s[to],
            };
            schedule.end_s = arrival_s + dwell_s(to);
            from = to;
        }
        Ok(schedule)
    }

    pub(crate) fn length_m(&self, time_s: f64) -> f64 {
        let started = self
            .stretches
            .partition_point(|stretch| stretch.start_s <= time_s);
        let under_way = started.checked_sub(1).map(|index| self.stretches[index]);
        under_way.map_or(0.0, |stretch| stretch.at_s(time_s))
    }
}

fn by_speed(motion: Motion, length_m: f64, speed_m_per_s: f64) -> (f64, SpeedCurve) {
    let cruise_s = length_m / speed_m_per_s;
    match motion {
        Motion::Constant => (cruise_s, SpeedCurve::Constant),
        Motion::MinimumJerk => (cruise_s, SpeedCurve::MinimumJerk),
        Motion::Trapezoidal {
            acceleration_m_per_s2,
        } => {
            let ramp_s = speed_m_per_s / acceleration_m_per_s2;
            if cruise_s >= ramp_s {
                (cruise_s + ramp_s, SpeedCurve::Ramps { ramp_s })
            } else {
                // Too short for full speed: accelerate over half the distance, then slow down.
                let ramp_s = (length_m / acceleration_m_per_s2).sqrt();
                (2.0 * ramp_s, SpeedCurve::Ramps { ramp_s })
            }
        }
    }
}

fn by_time(motion: Motion, length_m: f64, travel_s: f64) -> Option<(f64, SpeedCurve)> {
    let curve = match motion {
        Motion::Constant => SpeedCurve::Constant,
        Motion::MinimumJerk => SpeedCurve::MinimumJerk,
        Motion::Trapezoidal {
            acceleration_m_per_s2,
        } => {
            // L = a r (T - r), the smaller of the two roots.
            let square_s2 = length_m / acceleration_m_per_s2;
            let root_s2 = travel_s * travel_s - 4.0 * square_s2;
            if root_s2 < 0.0 {
                return None;
            }
            let ramp_s = 2.0 * square_s2 / (travel_s + root_s2.sqrt());
            SpeedCurve::Ramps { ramp_s }
        }
    };
    Some((travel_s, curve))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOSE: f64 = 1e-12;

    fn schedule(motion: Motion, clock: Clock<'_>) -> Schedule {
        Schedule::new(&[0.0, 3.0, 7.0], &[0.0, 2.0, 1.0], motion, clock).unwrap()
    }

    fn assert_at(schedule: &Schedule, expected: &[(f64, f64)]) {
        for (time_s, length_m) in expected {
            let found = schedule.length_m(*time_s);
            assert!((found - length_m).abs() < CLOSE, "at {time_s} s: {found} m");
        }
    }

    #[test]
    fn constant_speed_with_a_stop() {
        let walk = schedule(Motion::Constant, Clock::Speed(0.5));
        assert_eq!(walk.end_s, 6.0 + 2.0 + 8.0 + 1.0);
        let expected = [(0.0, 0.0), (6.0, 3.0), (7.9, 3.0), (9.0, 3.5), (16.0, 7.0)];
        assert_at(&walk, &expected);
    }

    /// 3 m at up to 1.5 m/s and 1 m/s²: ramps of 1.5 s and 1.125 m each, 0.75 m between them.
    #[test]
    fn a_trapezoid_has_the_area_of_a_trapezoid() {
        let motion = Motion::Trapezoidal {
            acceleration_m_per_s2: 1.0,
        };
        let walk = schedule(motion, Clock::Speed(1.5));
        let first = walk.stretches[0];
        assert!((first.travel_s - 3.5).abs() < CLOSE);
        assert!((first.speed_max_m_per_s() - 1.5).abs() < CLOSE);
        assert_at(
            &walk,
            &[
                (1.0, 0.5),
                (1.5, 1.125),
                (1.75, 1.5),
                (2.5, 2.5),
                (3.5, 3.0),
            ],
        );
        assert!((walk.stretches[1].start_s - 5.5).abs() < CLOSE, "after 2 s");
        for length_m in [0.1, 1.125, 1.5, 2.5, 2.9, 3.0] {
            let found = first.at_s(first.time_at(length_m));
            assert!((found - length_m).abs() < CLOSE, "{length_m}: {found}");
        }
    }

    #[test]
    fn a_short_stretch_is_a_triangle() {
        let motion = Motion::Trapezoidal {
            acceleration_m_per_s2: 2.0,
        };
        // 0.5 m at 2 m/s²: half of it takes 0.5 s, the speed reaches 1 m/s.
        let walk = Schedule::new(&[0.0, 0.5], &[], motion, Clock::Speed(1.5)).unwrap();
        assert!((walk.end_s - 1.0).abs() < CLOSE);
        assert!((walk.stretches[0].speed_max_m_per_s() - 1.0).abs() < CLOSE);
        assert_at(&walk, &[(0.25, 0.0625), (0.5, 0.25), (0.75, 0.4375)]);
    }

    #[test]
    fn least_jerk_peaks_at_fifteen_eighths_of_the_mean() {
        let walk = schedule(Motion::MinimumJerk, Clock::Speed(0.5));
        assert_at(&walk, &[(3.0, 1.5), (6.0, 3.0), (8.0, 3.0), (12.0, 5.0)]);
        let step_s = 1e-5;
        let speed = (walk.length_m(3.0 + step_s) - walk.length_m(3.0 - step_s)) / (2.0 * step_s);
        assert!((speed - 1.875 * 0.5).abs() < 1e-9, "{speed}");
        assert_eq!(walk.stretches[0].speed_max_m_per_s(), 1.875 * 0.5);
        // At a quarter of the time: 10/64 - 15/256 + 6/1024 = 0.103515625.
        assert_at(&walk, &[(1.5, 3.0 * 0.103_515_625)]);
    }

    #[test]
    fn time_stamps_are_kept() {
        let stamps = [1.0, 4.0, 12.0];
        for motion in [
            Motion::Constant,
            Motion::MinimumJerk,
            Motion::Trapezoidal {
                acceleration_m_per_s2: 2.0,
            },
        ] {
            let walk = schedule(motion, Clock::Stamps(&stamps));
            assert_eq!(walk.end_s, 13.0);
            assert_at(
                &walk,
                &[(0.0, 0.0), (1.0, 0.0), (2.5, 1.5), (4.0, 3.0), (6.0, 3.0)],
            );
            assert_at(&walk, &[(9.0, 5.0), (12.0, 7.0), (99.0, 7.0)]);
        }
        // 3 m in 3 s at 2 m/s²: r² - 3 r + 1.5 = 0.
        let walk = schedule(
            Motion::Trapezoidal {
                acceleration_m_per_s2: 2.0,
            },
            Clock::Stamps(&stamps),
        );
        let ramp_s = 0.5 * (3.0 - 3.0_f64.sqrt());
        assert!((walk.stretches[0].speed_max_m_per_s() - 2.0 * ramp_s).abs() < CLOSE);
    }

    #[test]
    fn unreachable_waypoints_are_named() {
        // 3 m in 3 s take at least 4/3 m/s².
        for (acceleration_m_per_s2, expected) in [(1.4, None), (1.3, Some(TooFast(1)))] {
            let motion = Motion::Trapezoidal {
                acceleration_m_per_s2,
            };
            let stamps = Clock::Stamps(&[1.0, 4.0, 12.0]);
            let found = Schedule::new(&[0.0, 3.0, 7.0], &[], motion, stamps);
            assert_eq!(found.err(), expected);
        }
    }
}
