//! Detects a file's layout from its beginning, and another sensor from its number of pixels.

use crate::lines::BYTE_ORDER_MARK;

/// A layout that this crate reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layout {
    /// The CSV recording format: [`csv::Reader`](crate::csv::Reader).
    Recording,
    /// The layout of the LINAIGE data set: [`linaige::Reader`](crate::linaige::Reader).
    Linaige,
}

/// The layout of a file from its first line; `None` if it is another's. The first columns identify even a faulty header, so that the layout's own reader can name the fault.
///
/// ```
/// use grideye_recording::{Layout, sniff};
/// assert_eq!(sniff("timestamp,thermistor,pixel0,pixel1"), Some(Layout::Linaige));
/// assert_eq!(sniff(grideye_recording::csv::header()), Some(Layout::Recording));
/// assert_eq!(sniff("23.25,".repeat(64)), None);
/// assert_eq!(sniff("P5 8 8 255"), None);
/// ```
#[must_use]
pub fn sniff(first_line: impl AsRef<[u8]>) -> Option<Layout> {
    let beginning = first_line.as_ref();
    let beginning = beginning.strip_prefix(BYTE_ORDER_MARK).unwrap_or(beginning);
    if beginning.starts_with(b"device,sensor,boot,seq,") {
        Some(Layout::Recording)
    } else if beginning.starts_with(b"timestamp,thermistor,pixel0,") {
        Some(Layout::Linaige)
    } else {
        None
    }
}

/// Sizes of images of other sensors, and of those that people interpolate to.
const SIZES: [(usize, &str); 9] = [
    (16, "4 x 4 pixels, as an Omron D6T-44L"),
    (32, "16 x 2 or 32 x 1 pixels"),
    (192, "16 x 12 pixels, as an MLX90641"),
    (256, "16 x 16 pixels, as an HTPA16x16"),
    (768, "32 x 24 pixels, as an MLX90640"),
    (1_024, "32 x 32 pixels, as an HTPA32x32 or a D6T-32L"),
    (4_900, "70 x 70 pixels, interpolated"),
    (4_800, "80 x 60 pixels, as a Lepton 2"),
    (19_200, "160 x 120 pixels, as a Lepton 3"),
];

/// Whether another sensor has this many pixels.
#[must_use]
pub fn is_known_size(pixels: usize) -> bool {
    SIZES.iter().any(|(known, _)| *known == pixels)
}

/// A phrase for a sensor with this many pixels.
#[must_use]
pub fn sensor_of(pixels: usize) -> String {
    match SIZES.iter().find(|(number, _)| *number == pixels) {
        Some((_, words)) => format!("this one has {words}"),
        None => "this one is of another sensor".to_owned(),
    }
}
