//! The sensor's clock: the time of each tick, and how its speed deviates from nominal.

use core::fmt;
use core::time::Duration;
use grideye_frame::TICK;

/// The array always measures ten times per second (AMG88 spec §4-11-3 and users' reports on 1 fps).
const PERIOD_NS: u128 = TICK.as_nanos();
const MILLION: i128 = 1_000_000;
/// The work of one tick, in nanoseconds times half millionths of nominal speed: the mean of two whole speeds is whole
/// in halves.
const WORK_PER_TICK: u128 = PERIOD_NS * 2_000_000;
const NANOSECONDS_PER_HOUR: u128 = 3_600_000_000_000;
const PPM_PER_HOUR_MAX: i32 = 2 * CLOCK_ERROR_PPM_MAX;

/// Counts from one origin in whole numbers, so that no error accumulates.
#[derive(Debug, Clone)]
pub(crate) struct Ticks {
    started_ns: u128,
    error_ppm: i32,
    drift: Drift,
    /// The current stretch, or an earlier one.
    stretch: Stretch,
}

/// A period in which the speed is constant or changes evenly.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    /// Host time of its start, in nanoseconds.
    origin_ns: u128,
    counted: u64,
    /// The part of the next tick already done at the origin, less than `WORK_PER_TICK`.
    done: u128,
    /// The speed at the origin: millionths of the nominal speed times `over_ns`, positive.
    speed: u128,
    /// How many millionths the speed rises ...
    rise: i32,
    /// ... in this many nanoseconds.
    over_ns: u128,
    /// Its length; `None` if it never ends.
    length_ns: Option<u128>,
}

impl Ticks {
    pub(crate) fn new(origin: Duration, clock_error_ppm: i32, drift: Drift) -> Self {
        let mut ticks = Self {
            started_ns: origin.as_nanos(),
            error_ppm: clock_error_ppm,
            drift,
            stretch: Stretch::steady(0),
        };
        ticks.stretch = ticks.from(ticks.started_ns, 0, 0);
        ticks
    }

    /// How many ticks have come by this time, including one that falls on it.
    pub(crate) fn count(&self, now: Duration) -> u64 {
        let stretch = self.holding_at(now.as_nanos());
        let elapsed_ns = now.as_nanos().saturating_sub(stretch.origin_ns);
        stretch.after(elapsed_ns).0
    }

    /// The first nanosecond at which [`count`](Self::count) reaches this tick.
    pub(crate) fn time(&self, tick: u64) -> Duration {
        let mut stretch = self.stretch;
        while let Some(length_ns) = stretch.length_ns {
            if stretch.after(length_ns).0 >= tick {
                break;
            }
            stretch = self.following(&stretch, length_ns);
        }
        let nanoseconds = stretch.origin_ns.saturating_add(stretch.time_until(tick));
        Duration::from_nanos(u64::try_from(nanoseconds).unwrap_or(u64::MAX))
    }

    /// Sets the error from now on; the drift continues and the current tick keeps its progress.
    pub(crate) fn set_error(&mut self, clock_error_ppm: i32, now: Duration) {
        self.error_ppm = clock_error_ppm;
        let now_ns = now.as_nanos();
        let before = self.holding_at(now_ns);
        self.stretch = if now_ns > before.origin_ns {
            self.following(&before, now_ns - before.origin_ns)
        } else {
            self.from(before.origin_ns, before.counted, before.done)
        };
    }

    /// Drops past stretches.
    pub(crate) fn settle(&mut self, now: Duration) {
        self.stretch = self.holding_at(now.as_nanos());
    }

    fn holding_at(&self, now_ns: u128) -> Stretch {
        let mut stretch = self.stretch;
        while let Some(length_ns) = stretch.length_ns {
            if now_ns < stretch.origin_ns.saturating_add(length_ns) {
                break;
            }
            stretch = self.following(&stretch, length_ns);
        }
        stretch
    }

    /// The stretch that follows `elapsed_ns` after this one's origin.
    fn following(&self, stretch: &Stretch, elapsed_ns: u128) -> Stretch {
        let (counted, done) = stretch.after(elapsed_ns);
        self.from(stretch.origin_ns.saturating_add(elapsed_ns), counted, done)
    }

    fn from(&self, origin_ns: u128, counted: u64, done: u128) -> Stretch {
        let age_ns = origin_ns.saturating_sub(self.started_ns);
        let stretch = match self.drift {
            Drift::None => Stretch::steady(self.error_ppm),
            Drift::PpmPerHour(rise) => self.even(rise, age_ns),
            Drift::Curve(curve) => {
                let (passed, coming) = curve.around(age_ns);
                self.between(passed, coming, age_ns)
            }
        };
        Stretch {
            origin_ns,
            counted,
            done,
            ..stretch
        }
    }

    /// A steady change per hour, until the error reaches its limit.
    fn even(&self, rise: i32, age_ns: u128) -> Stretch {
        let rise = rise.clamp(-PPM_PER_HOUR_MAX, PPM_PER_HOUR_MAX);
        let error = held(i64::from(self.error_ppm));
        let limit = CLOCK_ERROR_PPM_MAX * rise.signum();
        let steps = u128::from(limit.abs_diff(error));
        let Some(until_ns) =
            (steps * NANOSECONDS_PER_HOUR).checked_div(u128::from(rise.unsigned_abs()))
        else {
            return Stretch::steady(error);
        };
        if age_ns >= until_ns {
            return Stretch::steady(limit);
        }
        Stretch::line(error, rise, age_ns, NANOSECONDS_PER_HOUR, until_ns - age_ns)
    }

    /// A line between two points of a curve; beyond either end, the nearest point's error.
    fn between(&self, before: Option<Point>, after: Option<Point>, age_ns: u128) -> Stretch {
        let sum = |ppm: i32| held(i64::from(self.error_ppm) + i64::from(ppm));
        match (before, after) {
            (Some((from, least)), Some((to, last))) => {
                let over_ns = to.as_nanos() - from.as_nanos();
                let into_ns = age_ns - from.as_nanos();
                let (least, last) = (sum(least), sum(last));
                Stretch::line(least, last - least, into_ns, over_ns, over_ns - into_ns)
            }
            (None, Some((to, ppm))) => Stretch {
                length_ns: Some(to.as_nanos() - age_ns),
                ..Stretch::steady(sum(ppm))
            },
            (Some((_, ppm)), None) => Stretch::steady(sum(ppm)),
            (None, None) => Stretch::steady(self.error_ppm),
        }
    }
}

impl Stretch {
    fn steady(error_ppm: i32) -> Self {
        Self {
            origin_ns: 0,
            counted: 0,
            done: 0,
            speed: speed(held(i64::from(error_ppm)), 0, 0, 1),
            rise: 0,
            over_ns: 1,
            length_ns: None,
        }
    }

    /// A change of `rise` from `error_ppm` over `over_ns`; `into_ns` have passed and `length_ns` remain.
    fn line(error_ppm: i32, rise: i32, into_ns: u128, over_ns: u128, length_ns: u128) -> Self {
        Self {
            speed: speed(error_ppm, rise, into_ns, over_ns),
            rise,
            over_ns,
            length_ns: Some(length_ns),
            ..Self::steady(0)
        }
    }

    /// The ticks, and the part of the next one done, this long after the origin.
    fn after(&self, elapsed_ns: u128) -> (u64, u128) {
        let work = (self.work(elapsed_ns) / self.over_ns).saturating_add(self.done);
        let ticks = u64::try_from(work / WORK_PER_TICK).unwrap_or(u64::MAX);
        (self.counted.saturating_add(ticks), work % WORK_PER_TICK)
    }

    /// Half millionths of the nominal speed times nanoseconds times `over_ns`: twice the integral of the speed.
    fn work(&self, elapsed_ns: u128) -> u128 {
        let even = self.speed.saturating_mul(2).saturating_mul(elapsed_ns);
        let bend = u128::from(self.rise.unsigned_abs())
            .saturating_mul(elapsed_ns)
            .saturating_mul(elapsed_ns);
        if self.rise < 0 {
            even.saturating_sub(bend)
        } else {
            even.saturating_add(bend)
        }
    }

    /// The earliest time after the origin at which this tick has come, if within the stretch.
    fn time_until(&self, tick: u64) -> u128 {
        let ticks = u128::from(tick.saturating_sub(self.counted));
        let work = (ticks * WORK_PER_TICK).saturating_sub(self.done);
        if self.rise == 0 {
            return work.saturating_mul(self.over_ns).div_ceil(2 * self.speed);
        }
        let (mut early, mut late) = (0, self.length_ns.unwrap_or(0));
        while early < late {
            let middle = early + (late - early) / 2;
            if self.work(middle) / self.over_ns >= work {
                late = middle;
            } else {
                early = middle + 1;
            }
        }
        late
    }
}

/// Millionths of the nominal speed times `over_ns`.
fn speed(error_ppm: i32, rise: i32, into_ns: u128, over_ns: u128) -> u128 {
    let whole = (MILLION + i128::from(error_ppm)).saturating_mul(signed(over_ns));
    let risen = i128::from(rise).saturating_mul(signed(into_ns));
    u128::try_from(whole.saturating_add(risen)).unwrap_or(1)
}

fn signed(nanoseconds: u128) -> i128 {
    i128::try_from(nanoseconds).unwrap_or(i128::MAX)
}

fn held(error_ppm: i64) -> i32 {
    let limit = i64::from(CLOCK_ERROR_PPM_MAX);
    i32::try_from(error_ppm.clamp(-limit, limit)).unwrap_or(0)
}

/// The largest effective clock error, in parts per million either way: 50 %.
pub const CLOCK_ERROR_PPM_MAX: i32 = 500_000;

/// The longest time between two points of a [`DriftCurve`]: 100 days.
pub const DRIFT_STRETCH_MAX: Duration = Duration::from_secs(100 * 86_400);

/// An error that adds to [`Options::clock_error_ppm`](crate::Options::clock_error_ppm) after power-on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Drift {
    /// The error stays.
    #[default]
    None,
    /// The error changes by this many parts per million per hour, at most a million.
    PpmPerHour(i32),
    /// The error follows a curve.
    Curve(DriftCurve),
}

/// The time since power-on, and the error in parts per million.
pub(crate) type Point = (Duration, i32);

/// Points of (time since power-on, error in parts per million) joined by lines; constant before and after.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DriftCurve(&'static [(Duration, i32)]);

/// Why the points do not make a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriftError {
    /// There are no points.
    Empty,
    /// This point, counted from 0, is not later than the previous one.
    Order(usize),
    /// This point comes more than [`DRIFT_STRETCH_MAX`] after the previous one, or after power-on.
    Stretch(usize),
    /// This point's error in parts per million exceeds [`CLOCK_ERROR_PPM_MAX`].
    TooFar(usize, i32),
}

impl DriftCurve {
    /// A curve through these points.
    ///
    /// # Errors
    /// [`DriftError`] if there are no points, they are out of order, or a time or an error exceeds its limit.
    pub fn new(points: &'static [(Duration, i32)]) -> Result<Self, DriftError> {
        if points.is_empty() {
            return Err(DriftError::Empty);
        }
        let mut before: Option<Duration> = None;
        for (point, &(time, ppm)) in points.iter().enumerate() {
            if before.is_some_and(|before| time <= before) {
                return Err(DriftError::Order(point));
            }
            if time.saturating_sub(before.unwrap_or_default()) > DRIFT_STRETCH_MAX {
                return Err(DriftError::Stretch(point));
            }
            if ppm.unsigned_abs() > CLOCK_ERROR_PPM_MAX.unsigned_abs() {
                return Err(DriftError::TooFar(point, ppm));
            }
            before = Some(time);
        }
        Ok(Self(points))
    }

    /// The last point up to this time since power-on, and the first one after it.
    pub(crate) fn around(self, age_ns: u128) -> (Option<Point>, Option<Point>) {
        let points = self.0;
        let passed = points.partition_point(|(time, _)| time.as_nanos() <= age_ns);
        let (passed, coming) = points.split_at(passed);
        (passed.last().copied(), coming.first().copied())
    }
}

impl fmt::Display for DriftError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => formatter.write_str(
                "drift curve has no points\nhint: for a clock without drift, omit the curve",
            ),
            Self::Order(point) => write!(
                formatter,
                "point {point} of the drift curve is not later than the previous one"
            ),
            Self::Stretch(point) => write!(
                formatter,
                "point {point} of the drift curve comes more than {} days after the previous one\nhint: add points \
                 in between",
                DRIFT_STRETCH_MAX.as_secs() / 86_400
            ),
            Self::TooFar(point, ppm) => write!(
                formatter,
                "point {point} of the drift curve has an error of {ppm} ppm, at most {CLOCK_ERROR_PPM_MAX} either way is possible"
            ),
        }
    }
}

impl core::error::Error for DriftError {}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::DriftCurve;

    fn steady(origin: Duration, ppm: i32) -> Ticks {
        Ticks::new(origin, ppm, Drift::None)
    }

    /// Each tick comes exactly at its time, not a nanosecond earlier.
    fn check(ticks: &Ticks, numbers: &[u64], what: &str) {
        for tick in numbers {
            let time = ticks.time(*tick);
            let before = ticks.count(time - Duration::from_nanos(1));
            assert_eq!((ticks.count(time), before), (*tick, tick - 1), "{what}");
        }
    }

    #[test]
    fn ticks_every_tenth_of_a_second() {
        let ticks = steady(Duration::from_millis(7), 0);
        assert_eq!(ticks.count(Duration::ZERO), 0);
        assert_eq!(ticks.count(Duration::from_nanos(106_999_999)), 0);
        assert_eq!(ticks.count(Duration::from_millis(107)), 1);
        assert_eq!(ticks.time(1), Duration::from_millis(107));
        assert_eq!(ticks.time(864_000), Duration::from_millis(86_400_007));
    }

    #[test]
    fn time_and_count_agree_to_the_nanosecond_at_any_speed() {
        for ppm in [-500_000, -43_000, -40_000, -1, 0, 1, 33_333, 500_000] {
            let ticks = steady(Duration::from_nanos(123), ppm);
            let numbers = [1, 2, 3, 10, 999, 864_000, 123_456_789];
            check(&ticks, &numbers, &std::format!("{ppm} ppm"));
        }
    }

    /// A sensor 4 % slow gives 9.6 frames per second (reference section 2.4 and real-sensor statistics).
    #[test]
    fn a_slow_clock_loses_no_tick_over_a_day() {
        let ticks = steady(Duration::ZERO, -40_000);
        assert_eq!(ticks.time(1), Duration::from_nanos(104_166_667));
        assert_eq!(ticks.count(Duration::from_secs(86_400)), 829_440);
    }

    #[test]
    fn a_change_of_speed_keeps_the_phase() {
        let mut ticks = steady(Duration::ZERO, 0);
        ticks.set_error(-500_000, Duration::from_millis(250));
        assert_eq!(ticks.count(Duration::from_millis(250)), 2);
        assert_eq!(ticks.time(3), Duration::from_millis(350));
        assert_eq!(ticks.time(4), Duration::from_millis(550));
        assert_eq!(ticks.count(Duration::from_millis(549)), 3);
    }

    #[test]
    fn errors_beyond_the_limit_act_as_the_limit() {
        let at = |ppm| steady(Duration::ZERO, ppm).time(1);
        assert_eq!(at(i32::MIN), Duration::from_millis(200));
        assert_eq!(at(-CLOCK_ERROR_PPM_MAX), Duration::from_millis(200));
        assert_eq!(at(i32::MAX), at(CLOCK_ERROR_PPM_MAX));
    }

    const DAY: Duration = Duration::from_secs(86_400);

    /// The integral of the speed over a day: 864,000 ticks, plus d * 24^2 / 2 hour-millionths for a drift of d ppm per
    /// hour. For 100 ppm per hour, 28,800 ppm hours are 103.68 s, or 1,036.8 ticks.
    #[test]
    fn a_drift_by_the_hour_is_exact_over_a_day() {
        for (ppm_per_hour, count) in [(0, 864_000), (100, 865_036), (-100, 862_963), (1, 864_010)] {
            let ticks = Ticks::new(Duration::ZERO, 0, Drift::PpmPerHour(ppm_per_hour));
            assert_eq!(ticks.count(DAY), count, "{ppm_per_hour} ppm an hour");
        }
        // Tick 865,036 falls at the t that solves t + 50e-6 t^2 / 3600 = 86,503.6 s.
        let ticks = Ticks::new(Duration::ZERO, 0, Drift::PpmPerHour(100));
        let t = ticks.time(865_036).as_secs_f64();
        assert!((t + 50e-6 * t * t / 3600.0 - 86_503.6).abs() < 1e-9, "{t}");
    }

    #[test]
    fn time_and_count_agree_to_the_nanosecond_in_any_drift() {
        static POINTS: [(Duration, i32); 4] = [
            (Duration::from_secs(100), 20_000),
            (Duration::from_secs(1_000), -43_000),
            (Duration::from_nanos(1_000_000_000_001), -40_000),
            (Duration::from_secs(40_000), 7),
        ];
        let mut drifts = [-5_000, i32::MAX, 3, 0].map(Drift::PpmPerHour);
        drifts[3] = Drift::Curve(DriftCurve::new(&POINTS).unwrap());
        let ticks = [1, 2, 999, 1_000, 1_001, 9_600, 10_000, 10_001];
        let numbers = [&ticks[..], &[400_000, 864_000, 123_456_789]].concat();
        for drift in drifts {
            for ppm in [-40_000, 0, 600_000] {
                let ticks = Ticks::new(Duration::from_nanos(77), ppm, drift);
                check(&ticks, &numbers, &std::format!("{drift:?} {ppm}"));
            }
        }
    }

    /// A line from 20,000 to -20,000 ppm and back loses in the second half what it gained in the first.
    #[test]
    fn a_curve_is_the_integral_of_its_lines() {
        static POINTS: [(Duration, i32); 3] = [
            (Duration::ZERO, 20_000),
            (Duration::from_secs(43_200), -20_000),
            (Duration::from_secs(86_400), 20_000),
        ];
        let curve = Drift::Curve(DriftCurve::new(&POINTS).unwrap());
        let ticks = Ticks::new(Duration::ZERO, 0, curve);
        assert_eq!(ticks.time(864_000), DAY);
        assert_eq!(ticks.time(432_000), DAY / 2);
        // A quarter day in, the mean error so far is 10,000 ppm: 216,000 ticks plus a hundredth.
        assert_eq!(ticks.time(218_160), DAY / 4);
        // After the last point its error stays.
        assert_eq!(ticks.count(DAY * 2), 864_000 + 881_280);
    }

    #[test]
    fn a_drift_goes_on_when_the_error_is_set_and_when_time_is_settled() {
        let mut changed = Ticks::new(Duration::ZERO, 0, Drift::PpmPerHour(1_000));
        changed.settle(DAY / 3);
        changed.set_error(-8_000, DAY / 3);
        // 8 h with 0 to 8,000 ppm, then 16 h from 0 to 16,000 ppm: means of 4,000 and 8,000.
        let expected = 288_000.0 * 1.004 + 576_000.0 * 1.008;
        let found = f64::from(u32::try_from(changed.count(DAY)).unwrap());
        assert!(
            (0.0..1.0).contains(&(expected - found)),
            "{found} {expected}"
        );

        let mut once = Ticks::new(Duration::ZERO, 0, Drift::PpmPerHour(100));
        let often = once.clone();
        for second in 0..86_400 {
            once.settle(Duration::from_secs(second));
        }
        assert_eq!(once.time(865_036), often.time(865_036));
    }

    #[test]
    fn a_drift_ends_at_the_limit_of_the_error() {
        let ticks = Ticks::new(Duration::ZERO, 0, Drift::PpmPerHour(-1_000_000));
        // Half an hour from 0 to -50 %, a mean of -25 %; half speed from then on.
        assert_eq!(ticks.time(13_500), Duration::from_secs(1_800));
        assert_eq!(ticks.time(13_501), Duration::from_millis(1_800_200));
    }
}
