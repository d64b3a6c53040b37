//! Register addresses and bits, by name.

/// A register that the driver writes or starts a read at (AMG88 spec §4-11). The address advances after each byte read;
/// two-byte values keep their low byte at the even address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Register {
    /// PCTL, AMG88 spec §4-11-1: see [`power`].
    PowerControl = 0x00,
    /// RST, AMG88 spec §4-11-2: see [`reset`].
    Reset = 0x01,
    /// FPSC, AMG88 spec §4-11-3: see [`frame_rate`].
    FrameRate = 0x02,
    /// INTC, AMG88 spec §4-11-4: see [`interrupt`].
    InterruptControl = 0x03,
    /// STAT, AMG88 spec §4-11-5: see [`status`].
    Status = 0x04,
    /// SCLR, AMG88 spec §4-11-6: the bits of [`status`], written to clear them.
    StatusClear = 0x05,
    /// AVE, AMG88 spec §4-11-7: see [`average`].
    Average = 0x07,
    /// INTHL and INTHH, AMG88 spec §4-11-8: upper level, bits 7:0, and 11:8 in bits 3:0.
    UpperLevelLow = 0x08,
    UpperLevelHigh = 0x09,
    /// INTLL and INTLH, AMG88 spec §4-11-8: lower level.
    LowerLevelLow = 0x0A,
    LowerLevelHigh = 0x0B,
    /// IHYSL and IHYSH (INTSL and INTSH in the map table), AMG88 spec §4-11-8: hysteresis.
    HysteresisLow = 0x0C,
    HysteresisHigh = 0x0D,
    /// TTHL, AMG88 spec §4-11-9: thermistor, two bytes.
    Thermistor = 0x0E,
    /// INT0, AMG88 spec §4-11-10: interrupt table, eight bytes.
    InterruptTable = 0x10,
    /// The key of the moving average, AMG88 spec §4-11-7 (reserved in the 2011 edition's table, used in its text).
    AverageKey = 0x1F,
    /// T01L, AMG88 spec §4-11-11: pixels 1 to 64, two bytes each.
    Pixels = 0x80,
}

impl Register {
    #[expect(
        clippy::as_conversions,
        reason = "the variants are numbered by their addresses"
    )]
    pub(crate) const fn address(self) -> u8 {
        self as u8
    }

    /// The bytes that set this register: Panasonic's wire diagrams show one register per write (I2C interface, 2021).
    pub(crate) const fn set(self, value: u8) -> [u8; 2] {
        [self.address(), value]
    }
}

/// Values of [`Register::PowerControl`] (AMG88 spec §4-11-1).
pub(crate) mod power {
    pub(crate) const NORMAL: u8 = 0x00;
    pub(crate) const SLEEP: u8 = 0x10;
    pub(crate) const STANDBY_60_S: u8 = 0x20;
    pub(crate) const STANDBY_10_S: u8 = 0x21;
}

/// Values of [`Register::Reset`]; any other has no effect (AMG88 spec §4-11-2).
pub(crate) mod reset {
    pub(crate) const FLAGS: u8 = 0x30;
    pub(crate) const INITIAL: u8 = 0x3F;
}

/// Bits of [`Register::FrameRate`] (AMG88 spec §4-11-3).
pub(crate) mod frame_rate {
    /// FPS: set for one frame a second, clear for ten.
    pub(crate) const ONE_FPS: u8 = 1 << 0;
}

pub(crate) mod interrupt {
    /// INTEN: the INT pin is active.
    pub(crate) const PIN: u8 = 1 << 0;
    /// INTMOD: set for the absolute value, clear for the difference from the previous frame.
    pub(crate) const ABSOLUTE: u8 = 1 << 1;
}

/// Bits of [`Register::Status`] and [`Register::StatusClear`] (AMG88 spec §4-11-5, §4-11-6).
pub(crate) mod status {
    /// INTF, and INTCLR.
    pub(crate) const INTERRUPT: u8 = 1 << 1;
    /// OVF_IRS, and OVS_CLR.
    pub(crate) const PIXEL_OVERFLOW: u8 = 1 << 2;
    /// OVF_THS, and OVT_CLR: only in the 2011 edition (§4-10(5), §4-10(6)), gone in 2016.
    pub(crate) const THERMISTOR_OVERFLOW: u8 = 1 << 3;
}

/// Bits of [`Register::Average`] and the bytes of its key (AMG88 spec §4-11-7).
pub(crate) mod average {
    /// MAMOD: twice moving average.
    pub(crate) const TWICE: u8 = 1 << 5;
    /// Written to [`super::Register::AverageKey`] in this order before [`super::Register::Average`].
    pub(crate) const UNLOCK: [u8; 3] = [0x50, 0x45, 0x57];
    /// Written to [`super::Register::AverageKey`] afterwards.
    pub(crate) const LOCK: u8 = 0x00;
}
