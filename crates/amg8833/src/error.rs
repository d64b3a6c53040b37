//! Driver errors.

use crate::power::UndefinedPowerMode;
use core::fmt;

/// Why a driver call failed. `E` is the bus error, kept whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Error<E> {
    /// The bus reported an error.
    Bus(E),
    /// The bus twice reported success without filling the buffer, as virtio controllers may.
    ShortRead {
        /// The address of the first register read.
        register: u8,
        /// The bytes requested.
        expected: usize,
        /// The bytes delivered, up to the last one that changed.
        found: usize,
    },
    /// The power register held a value the datasheet does not define.
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
                 hint: the bus reported success for a transfer it did not make; check that the sensor is \
                 connected"
            ),
            Self::UndefinedPowerMode(error) => error.fmt(formatter),
        }
    }
}

impl<E: core::error::Error> core::error::Error for Error<E> {
    /// The bus error's own source: the bus error itself is already in this error's text.
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Bus(error) => error.source(),
            Self::ShortRead { .. } | Self::UndefinedPowerMode(_) => None,
        }
    }
}
