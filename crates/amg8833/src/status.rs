//! The flags of the status register.

use crate::register::status;

/// The sensor's flags (AMG88 spec §4-11-5); also names those to clear (AMG88 spec §4-11-6).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Status {
    /// INTF: at least one pixel is in the interrupt table. Follows the levels whether or not the pin is enabled, so it
    /// is set nearly always while the levels are at their power-on value of 0 °C.
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

    pub(crate) const fn byte(self) -> u8 {
        let mut byte = 0;
        if self.interrupt {
            byte |= status::INTERRUPT;
        }
        if self.pixel_overflow {
            byte |= status::PIXEL_OVERFLOW;
        }
        if self.thermistor_overflow {
            byte |= status::THERMISTOR_OVERFLOW;
        }
        byte
    }
}
