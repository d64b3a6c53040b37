use crate::cell::Column;
use core::fmt::Write as _;
use grideye_frame::PIXELS;

/// The columns before the pixels.
pub(super) const LEADING: [&str; 10] = [
    "device",
    "sensor",
    "boot",
    "seq",
    "t_boot_ns",
    "t_utc_ns",
    "clock",
    "t_arrival_ns",
    "missing",
    "thermistor",
];

/// How many columns a row has.
pub const COLUMNS: usize = LEADING.len() + PIXELS;

/// The column of a pixel by its index; pixels are numbered 1 to 64 as in the datasheet (AMG88 spec §4-5-1).
pub(super) const fn pixel_column(index: usize) -> Column {
    Column::Pixel(index + 1)
}

/// The first line of a recording, without its newline.
///
/// ```
/// let header = grideye_recording::csv::header();
/// assert!(header.starts_with("device,sensor,boot,seq,t_boot_ns,t_utc_ns,clock,t_arrival_ns,missing,thermistor,pixel1,"));
/// assert!(header.ends_with(",pixel64"));
/// ```
#[must_use]
pub fn header() -> String {
    let mut header = LEADING.join(",");
    for index in 0..PIXELS {
        // Writing to a `String` cannot fail.
        let _ = write!(header, ",{}", pixel_column(index));
    }
    header
}
