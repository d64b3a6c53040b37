//! How the sensor's clock strays from its nominal speed.

use core::fmt;
use core::time::Duration;

/// The largest error of a clock that has an effect, in parts per million either way: 50 %.
pub const CLOCK_ERROR_PPM_MAX: i32 = 500_000;

/// The longest stretch between two points of a [`DriftCurve`]: 100 days.
pub const DRIFT_STRETCH_MAX: Duration = Duration::from_secs(100 * 86_400);

/// How the error of the sensor's clock changes from power-on on: added to
/// [`Options::clock_error_ppm`](crate::Options::clock_error_ppm), within [`CLOCK_ERROR_PPM_MAX`] either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Drift {
    /// The error stays.
    #[default]
    None,
    /// The error changes evenly by this many parts per million in an hour, a million at most.
    PpmPerHour(i32),
    /// The error follows a curve.
    Curve(DriftCurve),
}

/// The time since power-on, and the error in parts per million.
pub(crate) type Point = (Duration, i32);

/// Points of (time since power-on, error in parts per million), with lines between them; constant before and after.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DriftCurve(&'static [(Duration, i32)]);

/// What is wrong with the points of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriftError {
    /// There are none.
    Empty,
    /// The point of this number, from 0, is not later than the one before.
    Order(usize),
    /// The point of this number comes more than [`DRIFT_STRETCH_MAX`] after the one before, or after power-on.
    Stretch(usize),
    /// The point of this number has an error in parts per million beyond [`CLOCK_ERROR_PPM_MAX`].
    TooFar(usize, i32),
}

impl DriftCurve {
    /// A curve through these points.
    ///
    /// # Errors
    ///
    /// When there are no points, when they are not in order of time, or when a time or an error is beyond its limit.
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
                "a drift curve without points\nhint: for a clock without drift, leave the curve out",
            ),
            Self::Order(point) => write!(
                formatter,
                "point {point} of the drift curve is not later than the one before"
            ),
            Self::Stretch(point) => write!(
                formatter,
                "point {point} of the drift curve comes more than {} days after the one before\nhint: put points in \
                 between",
                DRIFT_STRETCH_MAX.as_secs() / 86_400
            ),
            Self::TooFar(point, ppm) => write!(
                formatter,
                "point {point} of the drift curve has an error of {ppm} ppm, beyond {CLOCK_ERROR_PPM_MAX} either way"
            ),
        }
    }
}

impl core::error::Error for DriftError {}
