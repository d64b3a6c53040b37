//! The error of all file formats here.

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
    /// Not even a header.
    #[error(
        "line 1: expected a header that begins with {0}, found nothing\nhint: the file is empty; its writer stopped before the header"
    )]
    Empty(&'static str),
    /// The first line belongs to another layout or is no header.
    #[error(
        "line 1, field {field}: expected the column name {expected}, found {found}\nhint: recordings/README.md states the columns of each layout"
    )]
    UnknownHeader {
        /// The first field that differs, from 1.
        field: usize,
        /// The name that belongs there, or that the line should end.
        expected: String,
        /// What is there.
        found: String,
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
    /// A line longer than any of this layout.
    #[error("line {line}: expected at most {limit} bytes, found more")]
    LineTooLong {
        /// The line.
        line: u64,
        /// The limit in bytes.
        limit: usize,
    },
    /// Bytes that are not UTF-8.
    #[error("line {line}: expected text in UTF-8, found byte {byte:#04x} at column {column}")]
    NotText {
        /// The line.
        line: u64,
        /// Place of the first such byte in the line, from 1.
        column: usize,
        /// The byte.
        byte: u8,
    },
    /// Too few fields or too many.
    #[error("line {line}: expected {expected} fields, found {found}{}", field_count_hint(*.expected, *.found))]
    FieldCount {
        /// The line.
        line: u64,
        /// How many the layout has.
        expected: usize,
        /// How many the line has.
        found: usize,
    },
    /// A cell without the value that its column requires.
    #[error("line {line}, column {column}: expected {expected}, found {found}")]
    Cell {
        /// The line.
        line: u64,
        /// The column's name, for example `pixel17`.
        column: String,
        /// What belongs there.
        expected: String,
        /// What is there, escaped, and cut when long.
        found: String,
    },
    /// Sequence numbers that do not rise within their stream.
    #[error(
        "line {line}, column seq: expected more than {previous} in stream {stream}, found {found}\nhint: each frame appears once, in order; was the file joined from two?"
    )]
    NotAscending {
        /// The line.
        line: u64,
        /// Device, sensor and boot.
        stream: String,
        /// The stream's previous number.
        previous: u64,
        /// The number found.
        found: u64,
    },
    /// More streams than one recording may hold.
    #[error(
        "line {line}: expected at most {limit} streams in one recording, found one more\nhint: record fewer sensors at a time"
    )]
    TooManyStreams {
        /// The line.
        line: u64,
        /// The limit.
        limit: usize,
    },
    /// Writing an earlier row failed; the file ends there.
    #[error("line {0}: expected an intact file, found one with a failed last row")]
    WriterBroken(u64),
}

impl RecordingError {
    /// The line of the file, from 1.
    #[must_use]
    pub const fn line(&self) -> u64 {
        match self {
            Self::Io { line, .. }
            | Self::CutLine { line, .. }
            | Self::LineTooLong { line, .. }
            | Self::NotText { line, .. }
            | Self::FieldCount { line, .. }
            | Self::Cell { line, .. }
            | Self::NotAscending { line, .. }
            | Self::TooManyStreams { line, .. }
            | Self::WriterBroken(line) => *line,
            Self::Empty(_) | Self::UnknownHeader { .. } => 1,
        }
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
