//! The error of all file formats here.

use std::fmt::Display;
use std::io;

/// Why a recording could not be read or written. Lines count from 1, the header included.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// Reading or writing failed.
    #[error("line {line}: {source}")]
    Io {
        /// The line being read or written.
        line: u64,
        /// The error of the given reader or writer.
        source: io::Error,
    },
    /// The file ends within a line.
    #[error(
        "line {line}: expected a newline at its end, found the end of the file after {bytes} bytes\nhint: the file was cut here, or its last row only lacks a newline: add one if the row is whole"
    )]
    CutLine {
        /// The cut line.
        line: u64,
        /// How many bytes of it exist.
        bytes: usize,
    },
    /// A line that the layout does not allow.
    #[error("line {line}{what}")]
    Refused {
        /// The line.
        line: u64,
        /// Where in it, what belongs there and what is there.
        what: String,
    },
}

impl RecordingError {
    /// The line of the file, from 1.
    #[must_use]
    pub const fn line(&self) -> u64 {
        match self {
            Self::Io { line, .. } | Self::CutLine { line, .. } | Self::Refused { line, .. } => {
                *line
            }
        }
    }

    /// `what` follows the line's number.
    pub(crate) const fn refused(line: u64, what: String) -> Self {
        Self::Refused { line, what }
    }

    /// A cell without the value that its column requires; `found` is escaped, and cut when long.
    pub(crate) fn cell(line: u64, column: impl Display, expected: &str, found: &str) -> Self {
        let what = format!(", column {column}: expected {expected}, found {found}");
        Self::refused(line, what)
    }

    /// Too few fields or too many.
    pub(crate) fn field_count(line: u64, expected: usize, found: usize) -> Self {
        let hint = field_count_hint(expected, found);
        let what = format!(": expected {expected} fields, found {found}{hint}");
        Self::refused(line, what)
    }
}

fn field_count_hint(expected: usize, found: usize) -> String {
    match expected.checked_sub(found) {
        Some(missing @ 1..=63) => {
            format!(
                "\nhint: {missing} short: every row has a cell for each column of the header, empty ones included"
            )
        }
        _ => String::new(),
    }
}
