//! The flags of the status register.

use crate::register::status;

/// The sensor's flags (AMG88 spec §4-11-5); also names those to clear (AMG88 spec §4-11-6).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Status {
    /// INTF: at least one pixel is in the interrupt table, whether or not the pin is enabled.
    pub interrupt: bool,
    /// OVF_IRS: the conversion of at least one pixel overflowed.
    pub pixel_overflow: bool,
    /// OVF_THS: the conversion of the thermistor overflowed (2011 edition §4-10(5) only).
    pub thermistor_overflow: bool,
}

impl Status {
    /// Every flag, to clear them all.
    pub const ALL: Self = Self {
        interrupt: true,
        pixel_overflow: true,
        thermistor_overflow: true,
    };

    pub(crate) const fn from_byte(byte: u8) -> Self {
        Self {
            interrupt: byte & status::INTERRUPT != 0,
            pixel_overflow: byte & status::PIXEL_OVERFLOW != 0,
            thermistor_overflow: byte & status::THERMISTOR_OVERFLOW != 0,
        }
    }

    pub(crate) fn byte(self) -> u8 {
        let bit = |flag: bool, bit: u8| if flag { bit } else { 0 };
        bit(self.interrupt, status::INTERRUPT)
            | bit(self.pixel_overflow, status::PIXEL_OVERFLOW)
            | bit(self.thermistor_overflow, status::THERMISTOR_OVERFLOW)
    }
}
