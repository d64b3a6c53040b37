//! Why a call of the driver failed.

use crate::power::UndefinedPowerMode;
use core::fmt;

/// Why a transfer with the sensor did not succeed. `E` is the error of the bus, kept whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Error<E> {
    /// The bus reported an error.
    Bus(E),
    /// The bus reported success, but did not fill the buffer, twice in a row, as virtio controllers may.
    ShortRead {
        /// The address of the first register of the read.
        register: u8,
        /// The bytes asked for.
        expected: usize,
        /// The bytes delivered, counted up to the last one that changed.
        found: usize,
    },
    /// The power register held a value that the datasheet does not define.
    UndefinedPowerMode(UndefinedPowerMode),
}

impl<E> From<UndefinedPowerMode> for Error<E> {
    fn from(error: UndefinedPowerMode) -> Self {
        Self::UndefinedPowerMode(error)
    }
}

impl<E: fmt::Display> fmt::Display for Error<E> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(error) => write!(formatter, "i2c transfer failed: {error}"),
            Self::ShortRead {
                register,
                expected,
                found,
            } => write!(
                formatter,
                "short read from register {register:#04x}: expected {expected} bytes, found {found}\n\
                 hint: the bus reported success for a transfer that it did not carry out; check that the sensor \
                 is there"
            ),
            Self::UndefinedPowerMode(error) => error.fmt(formatter),
        }
    }
}

impl<E: core::error::Error> core::error::Error for Error<E> {
    /// What lies below the error of the bus, which is part of this error's own text.
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Bus(error) => error.source(),
            Self::ShortRead { .. } | Self::UndefinedPowerMode(_) => None,
        }
    }
}
