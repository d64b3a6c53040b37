//! The columns, and the order of rows.

use crate::cell::Column;
use crate::error::RecordingError;
use crate::record::{Row, StreamId};
use core::fmt::Write as _;
use grideye_frame::{NAME_CHARS_MAX, PIXELS};
use std::collections::BTreeMap;

const LEADING: [&str; 10] = [
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

/// Number of columns.
pub const COLUMNS: usize = LEADING.len() + PIXELS;

/// The column of a pixel by index; columns are numbered 1 to 64 as in the datasheet (AMG88 spec §4-5-1).
pub(super) const fn pixel_column(index: usize) -> Column {
    Column::Pixel(index + 1)
}

/// The header of a recording, without its newline.
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

/// Maximum number of further columns.
pub const LABELS_MAX: usize = 256;

/// The text of a label or of its column's name as a recording holds it, which has no quotation marks: a comma becomes a
/// semicolon, what is neither ASCII nor a letter or digit of any script a question mark, and the rest is cut after 64 characters.
#[must_use]
pub fn label(text: &str) -> String {
    let kept = |character: char| match character {
        ',' => ';',
        ' ' | '!'..='~' => character,
        // In any script.
        _ if character.is_alphanumeric() => character,
        _ => '?',
    };
    let text: String = text.trim().chars().take(NAME_CHARS_MAX).map(kept).collect();
    // No label is a spreadsheet's formula.
    match text.starts_with(['=', '+', '@'])
        || (text.starts_with('-') && text.parse::<f64>().is_err())
    {
        true => format!("'{text}"),
        false => text,
    }
}

/// Maximum number of streams (device, sensor and boot) in one recording.
pub const STREAMS_MAX: usize = 4096;

#[derive(Debug, Default)]
pub(super) struct Sequences(BTreeMap<StreamId, u64>);

impl Sequences {
    pub(super) fn admit(&mut self, line: u64, row: &Row) -> Result<(), RecordingError> {
        let found = row.record.seq;
        if let Some(last) = self.0.get_mut(&row.stream) {
            if found <= *last {
                let StreamId {
                    device,
                    sensor,
                    boot,
                } = &row.stream;
                let what = format!(
                    ", column seq: expected more than {last} in stream {device} {sensor} {boot}, found {found}\nhint: each frame appears once, in order; was the file joined from two?"
                );
                return Err(RecordingError::refused(line, what));
            }
            *last = found;
            return Ok(());
        }
        if self.0.len() == STREAMS_MAX {
            let what = format!(
                ": expected at most {STREAMS_MAX} streams in one recording, found one more\nhint: record fewer sensors at a time"
            );
            return Err(RecordingError::refused(line, what));
        }
        self.0.insert(row.stream.clone(), found);
        Ok(())
    }
}
