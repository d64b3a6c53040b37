//! Which layout a file is, by its beginning.

use crate::bare::{NPY_MAGIC, looks_like_rows};
use crate::lines::BYTE_ORDER_MARK;

/// A layout that this crate reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layout {
    /// The CSV recording format: [`csv::Reader`](crate::csv::Reader).
    Recording,
    /// The layout of the LINAIGE data set: [`linaige::Reader`](crate::linaige::Reader).
    Linaige,
    /// Rows of 64 temperatures and no more: [`bare::RowReader`](crate::bare::RowReader).
    Rows,
    /// numpy's `.npy`: [`bare::NpyReader`](crate::bare::NpyReader).
    Npy,
}

/// The layout whose header a file's first three lines, or more, begin with; `None` for any other file. A header with a fault
/// in it is still known by its first columns, so that the layout's own reader can name the fault.
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
