//! Detects a recording from its beginning, and another sensor from its number of pixels.

use crate::lines::BYTE_ORDER_MARK;

/// Whether a file is a recording of this project, by the first columns: they identify even a faulty header, so that
/// [`csv::Reader`](crate::csv::Reader) can name the fault.
///
/// ```
/// use grideye_recording::is_recording;
/// assert!(is_recording(grideye_recording::csv::header()));
/// assert!(!is_recording("timestamp,thermistor,pixel0,pixel1"));
/// assert!(!is_recording("23.25,".repeat(64)));
/// ```
#[must_use]
pub fn is_recording(beginning: impl AsRef<[u8]>) -> bool {
    let beginning = beginning.as_ref();
    let beginning = beginning.strip_prefix(BYTE_ORDER_MARK).unwrap_or(beginning);
    beginning.starts_with(b"device,sensor,boot,seq,")
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
