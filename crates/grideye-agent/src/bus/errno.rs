//! What the numbers mean by which Linux' adapters say that they failed.

use grideye_frame::NoData;

/// What the errno of a Linux adapter means: `i2c-bcm2835` (Raspberry Pi 0 to 4), `i2c-designware` (5), USB adapters.
#[must_use]
pub fn by_errno(errno: i32) -> NoData {
    match errno {
        ENXIO | EREMOTEIO => NoData::Nack,
        ETIMEDOUT => NoData::BusTimeout,
        ENODEV | ENOTCONN | ESHUTDOWN => NoData::Unplugged,
        _ => NoData::BusError,
    }
}

// Linux' numbers (include/uapi/asm-generic/errno*.h), the same on every machine that has a Raspberry Pi's header.
pub(super) const EPERM: i32 = 1;
pub(super) const ENOENT: i32 = 2;
pub(super) const ENXIO: i32 = 6;
pub(super) const EACCES: i32 = 13;
pub(super) const EBUSY: i32 = 16;
pub(super) const ENODEV: i32 = 19;
pub(super) const ENOTCONN: i32 = 107;
pub(super) const ESHUTDOWN: i32 = 108;
pub(super) const ETIMEDOUT: i32 = 110;
pub(super) const EREMOTEIO: i32 = 121;
