//! A frame as the registers hold it.

use grideye_frame::PIXELS;

/// A frame as the registers hold it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Words {
    pub(crate) pixels: [u16; PIXELS],
    pub(crate) thermistor: u16,
    pub(crate) pixel_overflow: bool,
    pub(crate) thermistor_overflow: bool,
}
