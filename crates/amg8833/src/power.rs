//! The power modes and their register bytes.

use crate::register::power;
use core::error::Error;
use core::fmt;

/// The sensor's power mode (AMG88 spec §4-11-1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PowerMode {
    /// Measures continuously; 4.5 mA (AMG88 spec §4-4).
    Normal,
    /// Does not measure. Reads are invalid, and the sensor obeys only the command for normal mode; 0.2 mA (AMG88 spec
    /// §4-4).
    Sleep,
    /// Measures at intervals; 0.8 mA (AMG88 spec §4-4).
    Standby(Standby),
}

/// How often the sensor measures in stand-by (AMG88 spec §4-11-1; missing from the 2021 interface description).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Standby {
    /// Every 10 s.
    TenSeconds,
    /// Every 60 s.
    SixtySeconds,
}

impl PowerMode {
    pub(crate) const fn command(self) -> u8 {
        match self {
            Self::Normal => power::NORMAL,
            Self::Sleep => power::SLEEP,
            Self::Standby(Standby::TenSeconds) => power::STANDBY_10_S,
            Self::Standby(Standby::SixtySeconds) => power::STANDBY_60_S,
        }
    }

    pub(crate) const fn from_byte(found: u8) -> Result<Self, UndefinedPowerMode> {
        match found {
            power::NORMAL => Ok(Self::Normal),
            power::SLEEP => Ok(Self::Sleep),
            power::STANDBY_10_S => Ok(Self::Standby(Standby::TenSeconds)),
            power::STANDBY_60_S => Ok(Self::Standby(Standby::SixtySeconds)),
            _ => Err(UndefinedPowerMode { found }),
        }
    }
}

impl fmt::Display for PowerMode {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Normal => "normal",
            Self::Sleep => "sleep",
            Self::Standby(Standby::TenSeconds) => "stand-by of 10 s",
            Self::Standby(Standby::SixtySeconds) => "stand-by of 60 s",
        })
    }
}

/// The power register held a value the datasheet does not define (AMG88 spec §4-11-1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UndefinedPowerMode {
    /// The register's value.
    pub found: u8,
}

impl fmt::Display for UndefinedPowerMode {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "undefined power mode: expected 0x00, 0x10, 0x20 or 0x21, found {:#04x}\n\
             hint: initialize the sensor again; another program or bus noise wrote to it",
            self.found
        )
    }
}

impl Error for UndefinedPowerMode {}
