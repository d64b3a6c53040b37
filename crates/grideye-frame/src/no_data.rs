//! A frame or the reason why there is none.

use core::fmt;
use core::str::FromStr;

/// A sensor frame, or the reason why there is none. Never a magic temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading<T> {
    /// The frame was read.
    Frame(T),
    /// The sensor measured, or should have, and nothing was read.
    NoData(NoData),
}

impl<T> Reading<T> {
    /// The frame, if there is one.
    pub const fn frame(&self) -> Option<&T> {
        match self {
            Self::Frame(frame) => Some(frame),
            Self::NoData(_) => None,
        }
    }

    /// Converts the frame, if there is one.
    pub fn map<U>(self, turn: impl FnOnce(T) -> U) -> Reading<U> {
        match self {
            Self::Frame(frame) => Reading::Frame(turn(frame)),
            Self::NoData(reason) => Reading::NoData(reason),
        }
    }
}

crate::named! {
    /// Why there is no frame. The names appear on the wire and in recordings.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
    pub enum NoData {
        /// The sensor did not acknowledge its address or a byte (EREMOTEIO, ENXIO).
        Nack = "nack";
        /// The controller reported a fault of the bus (EIO, EAGAIN).
        BusError = "bus-error";
        /// The transfer did not end in time: the bus is held low or stretched (ETIMEDOUT).
        BusTimeout = "bus-timeout";
        /// The adapter itself is gone (ENODEV, ENOTCONN).
        Unplugged = "unplugged";
        /// Fewer messages or bytes arrived than requested.
        ShortTransfer = "short-transfer";
        /// The sensor updated its registers while the host was kept from reading them.
        HostStalled = "host-stalled";
        /// The sensor was asleep, starting or being set up again after a reset.
        NotReady = "not-ready";
        /// Every pixel word had all bits set: the data line is stuck high.
        StuckHigh = "stuck-high";
        /// Every pixel word was zero: a dead link, or a sensor that has not measured yet.
        AllZero = "all-zero";
        /// The registers did not change for many frames: a sensor that has stopped measuring.
        Frozen = "frozen";
        /// The sensor's settings were not the configured ones.
        WrongConfiguration = "wrong-configuration";
    }
}

impl fmt::Display for NoData {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// The name is not a [`NoData`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnknownNoData;

impl fmt::Display for UnknownNoData {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("no such reason for a missing frame; expected one of")?;
        for reason in NoData::ALL {
            write!(formatter, " {reason}")?;
        }
        Ok(())
    }
}

impl core::error::Error for UnknownNoData {}

impl FromStr for NoData {
    type Err = UnknownNoData;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::from_name(name).ok_or(UnknownNoData)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    /// The names that `recordings/README.md` specifies; files and stores contain them.
    #[test]
    fn the_names_are_those_of_the_format() {
        assert_eq!(
            UnknownNoData.to_string(),
            "no such reason for a missing frame; expected one of nack bus-error bus-timeout unplugged short-transfer \
             host-stalled not-ready stuck-high all-zero frozen wrong-configuration"
        );
        for reason in NoData::ALL {
            assert_eq!(reason.name().parse(), Ok(reason));
        }
        assert_eq!("".parse::<NoData>(), Err(UnknownNoData));
        assert_eq!("Nack".parse::<NoData>(), Err(UnknownNoData));
    }

    #[test]
    fn a_reading_gives_its_frame_and_keeps_its_reason() {
        let frame = Reading::Frame(2);
        let none: Reading<i32> = Reading::NoData(NoData::Frozen);
        assert_eq!((frame.frame(), none.frame()), (Some(&2), None));
        assert_eq!(frame.map(|steps| steps * 10), Reading::Frame(20));
        let none = none.map(|steps| steps * 10);
        assert_eq!(none, Reading::NoData(NoData::Frozen));
    }
}
