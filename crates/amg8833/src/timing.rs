//! The waits the sensor needs.

use core::num::NonZeroU32;
use core::time::Duration;
use grideye_frame::PIXELS;

/// From power-on until the sensor answers on the bus, typical (AMG88 spec §4-4).
pub const POWER_ON: Duration = Duration::from_millis(50);

/// From power-on until the temperatures are stable, typical (AMG88 spec §4-4).
pub const STABLE_OUTPUT: Duration = Duration::from_secs(15);

/// Minimum time from the command for normal mode to the initial reset (AMG88 spec §4-11-1).
pub const WAKE: Duration = Duration::from_millis(50);

/// Minimum time from the initial reset to the flag reset (AMG88 spec §4-11-2).
pub const INITIAL_RESET: Duration = Duration::from_millis(2);

/// Minimum time from the command for sleep to the command for normal mode.
///
/// The authors of Linux' `video-i2c` found that a sensor woken sooner may never update its registers again.
pub const SLEEP_ENTRY: Duration = Duration::from_millis(100);

/// Frames to wait after a wake, a reset or power-on: until then the pixels may read 0 (AMG88 spec §4-11-2, §4-11-5).
pub const SETTLING_FRAMES: u32 = 2;

/// How much slower than nominal a sensor may run, in percent: a 10 Hz sensor was measured at 9.57 Hz.
pub const SLOW_CLOCK_PERCENT: u32 = 10;

/// Bits that [`read_frame`](crate::Amg8833::read_frame) takes on the bus.
pub const READ_BITS: u32 = read_bits(2 * PIXELS) + read_bits(2);

/// The shortest time to read a frame at this bus clock.
#[must_use]
pub fn read_time(scl_hz: NonZeroU32) -> Duration {
    Duration::from_secs(READ_BITS.into()) / scl_hz.get()
}

/// START, repeated START and STOP; nine bits each for the address, the register, the address and each byte read.
const fn read_bits(bytes: usize) -> u32 {
    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        reason = "evaluated at compile time, on the 128 bytes of a frame at most"
    )]
    let bytes = bytes as u32;
    3 + 9 * (3 + bytes)
}
