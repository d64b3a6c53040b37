//! Detects a file's layout from its beginning, and another sensor from the number of pixels in its header.

use crate::bare::{NPY_MAGIC, looks_like_rows};
use crate::lines::BYTE_ORDER_MARK;
use grideye_frame::PIXELS;

/// A layout that this crate reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layout {
    /// The CSV recording format: [`csv::Reader`](crate::csv::Reader).
    Recording,
    /// The layout of the LINAIGE data set: [`linaige::Reader`](crate::linaige::Reader).
    Linaige,
    /// Rows of 64 temperatures only: [`bare::RowReader`](crate::bare::RowReader).
    Rows,
    /// numpy's `.npy`: [`bare::NpyReader`](crate::bare::NpyReader).
    Npy,
}

/// The layout of a file, from its first three lines or more; `None` if unknown. The first columns identify even a
/// faulty header, so that the layout's own reader can name the fault.
///
/// ```
/// use grideye_recording::{Layout, sniff};
/// assert_eq!(sniff("timestamp,thermistor,pixel0,pixel1"), Some(Layout::Linaige));
/// assert_eq!(sniff(grideye_recording::csv::header()), Some(Layout::Recording));
/// assert_eq!(sniff("23.25,".repeat(64)), Some(Layout::Rows));
/// assert_eq!(sniff(b"\x93NUMPY\x01\x00"), Some(Layout::Npy));
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
    } else if beginning.starts_with(NPY_MAGIC) {
        Some(Layout::Npy)
    } else {
        let text = String::from_utf8_lossy(beginning);
        looks_like_rows(&text).then_some(Layout::Rows)
    }
}

/// The number of pixels in a recording's header, if it is not a Grid-EYE's.
#[must_use]
pub fn other_resolution(beginning: &[u8]) -> Option<usize> {
    sniff(beginning)?;
    let mut lines = beginning.splitn(2, |&byte| byte == b'\n');
    let (line, is_whole) = (lines.next().unwrap_or_default(), lines.next().is_some());
    let is_pixel = |name: &&[u8]| {
        let digits = name.trim_ascii().strip_prefix(b"pixel").unwrap_or_default();
        !digits.is_empty() && digits.iter().all(u8::is_ascii_digit)
    };
    let pixels = line.split(|&byte| byte == b',').filter(is_pixel).count();
    // A header that lacks only a few columns is faulty, and its reader names the fault.
    let is_other = pixels > PIXELS || (is_whole && pixels > 0 && pixels <= PIXELS / 2);
    is_other.then_some(pixels)
}

/// A phrase for a sensor with this many pixels.
#[must_use]
pub fn sensor_of(pixels: usize) -> String {
    let known = [
        (16, "4 x 4 pixels, as an Omron D6T-44L"),
        (32, "16 x 2 or 32 x 1 pixels"),
        (192, "16 x 12 pixels, as an MLX90641"),
        (256, "16 x 16 pixels, as an HTPA16x16"),
        (768, "32 x 24 pixels, as an MLX90640"),
        (1_024, "32 x 32 pixels, as an HTPA32x32 or a D6T-32L"),
        (4_800, "80 x 60 pixels, as a Lepton 2"),
        (19_200, "160 x 120 pixels, as a Lepton 3"),
    ];
    match known.iter().find(|(number, _)| *number == pixels) {
        Some((_, words)) => format!("this one has {words}"),
        None => "this one is of another sensor".to_owned(),
    }
}
