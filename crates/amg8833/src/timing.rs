//! The waits that the sensor needs, by name.

use core::num::NonZeroU32;
use core::time::Duration;
use grideye_frame::PIXELS;

/// From power-on until the sensor answers on the bus, typical (AMG88 spec §4-4).
pub const POWER_ON: Duration = Duration::from_millis(50);

/// From power-on until the temperatures are stable, typical (AMG88 spec §4-4).
pub const STABLE_OUTPUT: Duration = Duration::from_secs(15);

/// From the command for normal mode to the initial reset, at least (AMG88 spec §4-11-1).
pub const WAKE: Duration = Duration::from_millis(50);

/// From the initial reset to the flag reset, at least (AMG88 spec §4-11-2).
pub const INITIAL_RESET: Duration = Duration::from_millis(2);

/// From the command for sleep to any command for normal mode.
///
/// The datasheet is silent; the authors of Linux' `video-i2c` found that a sensor which is woken at once now and then
/// never renews its registers again, and wait as long as this. It is the best known cause of frozen frames.
pub const SLEEP_ENTRY: Duration = Duration::from_millis(100);

/// Frames to wait after a wake, a reset or power-on before temperatures (AMG88 spec §4-11-2) and the interrupt flag
/// (AMG88 spec §4-11-5) may be trusted: until then the pixels may read 0.
pub const SETTLING_FRAMES: u32 = 2;

/// How much slower than nominal the sensor's clock is taken to be where frames are waited for, in per cent.
///
/// The datasheet gives no tolerance; 9.57 Hz was measured on a part set to 10 Hz.
pub const SLOW_CLOCK_PERCENT: u32 = 10;

/// Bits that [`read_frame`](crate::Amg8833::read_frame) takes on the bus: the pixels and the thermistor, read from a
/// register on.
pub const READ_BITS: u32 = read_bits(2 * PIXELS) + read_bits(2);

/// The least time that a frame takes on a bus of this clock.
#[must_use]
pub fn read_time(scl_hz: NonZeroU32) -> Duration {
    Duration::from_secs(READ_BITS.into()) / scl_hz.get()
}

/// START, repeated START and STOP; and nine bits for each of the address, the register, the address and the bytes read.
const fn read_bits(bytes: usize) -> u32 {
    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        reason = "evaluated at compile time, on the 128 bytes of a frame at most"
    )]
    let bytes = bytes as u32;
    3 + 9 * (3 + bytes)
}
