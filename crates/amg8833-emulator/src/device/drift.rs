//! How the sensor's clock strays from its nominal speed.

use core::fmt;
use core::time::Duration;

/// Beyond this, in parts per million either way, [`Options::clock_error_ppm`](crate::Options::clock_error_ppm) has no further effect: 50 %.
pub const CLOCK_ERROR_PPM_MAX: i32 = 500_000;

/// The longest stretch between two points of a [`DriftCurve`]: 100 days.
pub const DRIFT_STRETCH_MAX: Duration = Duration::from_secs(100 * 86_400);

/// How the error of the sensor's clock changes from power-on on, beside
/// [`Options::clock_error_ppm`](crate::Options::clock_error_ppm)(crate::Options::clock_error_ppm), to which it is added.
///
/// The sum is held within [`CLOCK_ERROR_PPM_MAX`] either way. The time of every tick is counted in whole numbers:
/// what is rounded off is less than a millionth of a nanosecond each time that the drift, or the error by call, changes.
/// For an error that follows anything else, call [`Device::set_clock_error_ppm`](crate::Device::set_clock_error_ppm)
/// as often as it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Drift {
    /// The error stays.
    #[default]
    None,
    /// The error grows, or with a negative number falls, by this many parts per million in an hour, without steps. More
    /// than a million has no further effect.
    PpmPerHour(i32),
    /// The error follows a curve.
    Curve(DriftCurve),
}

/// Points of (time since power-on, error in parts per million): a line from each to the next, the first one's error
/// before it and the last one's after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DriftCurve(&'static [(Duration, i32)]);

/// What is wrong with the points of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriftError {
    /// There are none.
    Empty,
    /// This point, counted from 0, is not later than the one before.
    Order {
        /// Its place among the points.
        point: usize,
    },
    /// This point, counted from 0, comes more than [`DRIFT_STRETCH_MAX`] after the one before, or after power-on.
    Stretch {
        /// Its place among the points.
        point: usize,
    },
    /// This point, counted from 0, is beyond [`CLOCK_ERROR_PPM_MAX`].
    TooFar {
        /// Its place among the points.
        point: usize,
        /// Its error in parts per million.
        ppm: i32,
    },
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
                return Err(DriftError::Order { point });
            }
            if time.saturating_sub(before.unwrap_or_default()) > DRIFT_STRETCH_MAX {
                return Err(DriftError::Stretch { point });
            }
            if ppm.unsigned_abs() > CLOCK_ERROR_PPM_MAX.unsigned_abs() {
                return Err(DriftError::TooFar { point, ppm });
            }
            before = Some(time);
        }
        Ok(Self(points))
    }

    pub(crate) fn point(self, place: usize) -> Option<(Duration, i32)> {
        self.0.get(place).copied()
    }
}

impl fmt::Display for DriftError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => formatter.write_str(
                "a drift curve without points\nhint: for a clock without drift, leave the curve out",
            ),
            Self::Order { point } => write!(
                formatter,
                "point {point} of the drift curve is not later than the one before"
            ),
            Self::Stretch { point } => write!(
                formatter,
                "point {point} of the drift curve comes more than {} days after the one before\nhint: put points in \
                 between",
                DRIFT_STRETCH_MAX.as_secs() / 86_400
            ),
            Self::TooFar { point, ppm } => write!(
                formatter,
                "point {point} of the drift curve has an error of {ppm} ppm, beyond {CLOCK_ERROR_PPM_MAX} either way"
            ),
        }
    }
}

impl core::error::Error for DriftError {}
