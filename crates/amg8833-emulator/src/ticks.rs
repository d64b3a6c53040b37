use crate::CLOCK_ERROR_PPM_MAX;
use core::time::Duration;

/// The array always measures ten times a second (AMG88 spec §4-11-3 with the users' reports on 1 fps).
const PERIOD_NS: u128 = 100_000_000;
const MILLION: u128 = 1_000_000;
/// What the sensor's clock has to run through for one tick, in nanoseconds times millionths of its nominal speed.
const WORK_PER_TICK: u128 = PERIOD_NS * MILLION;

/// The sensor's own clock: which internal tick falls at what time of the host.
///
/// Counts from one origin in whole numbers, so that nothing accumulates however long it runs.
#[derive(Debug, Clone)]
pub(crate) struct Ticks {
    /// Host time in nanoseconds from which the present speed holds.
    origin_ns: u128,
    /// Ticks at the origin.
    counted: u64,
    /// Part of the next tick that was already done at the origin, less than `WORK_PER_TICK`.
    done: u128,
    /// Millionths of the nominal speed, positive.
    speed: u128,
}

impl Ticks {
    pub(crate) fn new(origin: Duration, clock_error_ppm: i32) -> Self {
        Self {
            origin_ns: origin.as_nanos(),
            counted: 0,
            done: 0,
            speed: speed(clock_error_ppm),
        }
    }

    /// How many ticks have come by this time; a tick that falls on it has come.
    pub(crate) fn count(&self, now: Duration) -> u64 {
        let elapsed = now.as_nanos().saturating_sub(self.origin_ns);
        let work = elapsed.saturating_mul(self.speed).saturating_add(self.done);
        self.counted
            .saturating_add(u64::try_from(work / WORK_PER_TICK).unwrap_or(u64::MAX))
    }

    /// The first nanosecond at which [`count`](Self::count) reaches this tick.
    pub(crate) fn time(&self, tick: u64) -> Duration {
        let work = u128::from(tick.saturating_sub(self.counted)) * WORK_PER_TICK;
        let elapsed = work.saturating_sub(self.done).div_ceil(self.speed);
        let nanoseconds = self.origin_ns.saturating_add(elapsed);
        Duration::from_nanos(u64::try_from(nanoseconds).unwrap_or(u64::MAX))
    }

    /// Another speed from now on; the tick under way keeps what of it is done.
    pub(crate) fn set_error(&mut self, clock_error_ppm: i32, now: Duration) {
        let now_ns = now.as_nanos();
        if now_ns > self.origin_ns {
            let work = (now_ns - self.origin_ns).saturating_mul(self.speed) + self.done;
            self.counted = self.count(now);
            self.done = work % WORK_PER_TICK;
            self.origin_ns = now_ns;
        }
        self.speed = speed(clock_error_ppm);
    }
}

fn speed(clock_error_ppm: i32) -> u128 {
    let error = clock_error_ppm.clamp(-CLOCK_ERROR_PPM_MAX, CLOCK_ERROR_PPM_MAX);
    u128::try_from(1_000_000 + error).unwrap_or(MILLION)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_every_tenth_of_a_second() {
        let ticks = Ticks::new(Duration::from_millis(7), 0);
        assert_eq!(ticks.count(Duration::ZERO), 0);
        assert_eq!(ticks.count(Duration::from_nanos(106_999_999)), 0);
        assert_eq!(ticks.count(Duration::from_millis(107)), 1);
        assert_eq!(ticks.time(1), Duration::from_millis(107));
        assert_eq!(ticks.time(864_000), Duration::from_millis(86_400_007));
    }

    #[test]
    fn time_and_count_agree_to_the_nanosecond_at_any_speed() {
        for ppm in [-500_000, -43_000, -40_000, -1, 0, 1, 33_333, 500_000] {
            let ticks = Ticks::new(Duration::from_nanos(123), ppm);
            for tick in [1, 2, 3, 10, 999, 864_000, 123_456_789] {
                let time = ticks.time(tick);
                assert_eq!(ticks.count(time), tick, "{ppm} ppm");
                assert_eq!(
                    ticks.count(time - Duration::from_nanos(1)),
                    tick - 1,
                    "{ppm} ppm"
                );
            }
        }
    }

    /// Reference section 2.4 and real-sensor statistics: a sensor 4 % slow gives 9.6 frames a second.
    #[test]
    fn a_slow_clock_loses_no_tick_over_a_day() {
        let ticks = Ticks::new(Duration::ZERO, -40_000);
        assert_eq!(ticks.time(1), Duration::from_nanos(104_166_667));
        assert_eq!(ticks.count(Duration::from_secs(86_400)), 829_440);
    }

    #[test]
    fn a_change_of_speed_keeps_the_phase() {
        let mut ticks = Ticks::new(Duration::ZERO, 0);
        ticks.set_error(-500_000, Duration::from_millis(250));
        assert_eq!(ticks.count(Duration::from_millis(250)), 2);
        assert_eq!(ticks.time(3), Duration::from_millis(350));
        assert_eq!(ticks.time(4), Duration::from_millis(550));
        assert_eq!(ticks.count(Duration::from_millis(549)), 3);
    }

    #[test]
    fn errors_beyond_the_limit_act_as_the_limit() {
        let at = |ppm| Ticks::new(Duration::ZERO, ppm).time(1);
        assert_eq!(at(i32::MIN), Duration::from_millis(200));
        assert_eq!(at(-CLOCK_ERROR_PPM_MAX), Duration::from_millis(200));
        assert_eq!(at(i32::MAX), at(CLOCK_ERROR_PPM_MAX));
    }
}
