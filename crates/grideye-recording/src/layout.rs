//! Which layout a text file is, by its first line.

/// A layout that this crate reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layout {
    /// The CSV recording format: [`csv::Reader`](crate::csv::Reader).
    Recording,
    /// The layout of the LINAIGE data set: [`linaige::Reader`](crate::linaige::Reader).
    Linaige,
}

/// The layout whose header a file begins with; `None` for any other file.
///
/// Takes the first line, or any longer beginning of the file. A header with a fault in it is still known by its first
/// columns, so that the layout's own reader can name the fault.
///
/// ```
/// use grideye_recording::{Layout, sniff};
/// assert_eq!(sniff("timestamp,thermistor,pixel0,pixel1"), Some(Layout::Linaige));
/// assert_eq!(sniff(grideye_recording::csv::header()), Some(Layout::Recording));
/// assert_eq!(sniff("P5 8 8 255"), None);
/// ```
#[must_use]
pub fn sniff(first_line: impl AsRef<[u8]>) -> Option<Layout> {
    let beginning = first_line.as_ref();
    if beginning.starts_with(b"device,sensor,boot,seq,") {
        Some(Layout::Recording)
    } else if beginning.starts_with(b"timestamp,thermistor,pixel0,") {
        Some(Layout::Linaige)
    } else {
        None
    }
}
