//! Why a file could not be read, or not to its end.

use grideye_recording::{RecordingError, printable, sensor_of};
use std::io;

/// Why a file could not be read, or not to its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A recording of this project with a fault.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The file breaks here; what came before is good.
    #[error("{}: {}\nhint: {hint}", printable(place), printable(found))]
    Broken {
        /// Where.
        place: String,
        /// What is there.
        found: String,
        /// What is still good.
        hint: &'static str,
    },
    /// No row has the numbers of a frame.
    #[error(
        "expected rows of 64 numbers, found {found} at most\nhint: a frame is 64 numbers in a row, a list or eight lines of eight; {}",
        sensor(*.found, *.lines)
    )]
    NoFrame {
        /// The most numbers in a row.
        found: usize,
        /// How many rows have as many.
        lines: usize,
    },
    /// Rows of more numbers than a frame has, all of one kind.
    #[error(
        "{found} numbers in a row, all of one kind, where a Grid-EYE has 64: as of an image that was interpolated\nhint: these are rows of an image that was interpolated, of which the 8 x 8 pixels cannot be had: record what the sensor gave"
    )]
    Interpolated {
        /// The numbers in a row.
        found: usize,
    },
    /// A file that is no recording.
    #[error("this is {found}\nhint: {hint}")]
    Foreign {
        /// What it is.
        found: &'static str,
        /// How to make a recording of it.
        hint: &'static str,
    },
    /// Frames of another size.
    #[error(
        "{found} pixels a frame, a Grid-EYE has 64 (8 x 8)\nhint: only recordings of 8 x 8 pixels are compared and converted; {}",
        sensor_of(*.found)
    )]
    OtherSensor {
        /// The pixels of a frame.
        found: usize,
    },
    /// What the columns are cannot be told.
    #[error("{}\nhint: {}", printable(what), printable(hint))]
    Unclear {
        /// What is not clear.
        what: String,
        /// What to say.
        hint: String,
    },
    /// A file that becomes more than one of its size may.
    #[error(
        "{}: it becomes {bound}\nhint: if it is what you recorded, unpack it or save it as plain CSV, which is read line by line and may have any length",
        printable(place)
    )]
    TooLarge {
        /// Where.
        place: String,
        /// What a file of its size may become.
        bound: String,
    },
    /// A file of a kind that is not read.
    #[error("expected {expected}, found {}\nhint: {hint}", printable(found))]
    Container {
        /// What is read.
        expected: String,
        /// What is there.
        found: String,
        /// What to do.
        hint: &'static str,
    },
}

impl ImportError {
    /// What could not be read there, or is more than the file may become.
    pub(crate) fn unread(place: impl Into<String>, error: &io::Error) -> Self {
        if error.kind() != io::ErrorKind::FileTooLarge {
            return Self::broken(place, error.to_string());
        }
        Self::TooLarge {
            place: place.into(),
            bound: error.to_string(),
        }
    }

    pub(crate) fn broken(place: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Broken {
            place: place.into(),
            found: found.into(),
            hint: "the file breaks off here; the frames before are whole",
        }
    }

    pub(crate) fn cut_line(place: impl Into<String>) -> Self {
        Self::Broken {
            place: place.into(),
            found: "the last line has no newline, and may be cut within a number".to_owned(),
            hint: "the frames before are whole; if this line is whole too, end it with a newline",
        }
    }

    pub(crate) const fn no_frame(found: usize, lines: usize) -> Self {
        Self::NoFrame { found, lines }
    }

    pub(crate) fn unclear(what: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Unclear {
            what: what.into(),
            hint: hint.into(),
        }
    }

    /// The line of the file, from 1, where the error knows it.
    #[must_use]
    pub const fn line(&self) -> Option<u64> {
        match self {
            Self::Recording(error) => Some(error.line()),
            _ => None,
        }
    }

    /// Whether frames before it were read, and are whole.
    #[must_use]
    pub const fn is_break(&self) -> bool {
        matches!(
            self,
            Self::Broken { .. } | Self::Recording(RecordingError::CutLine { .. })
        )
    }
}

fn sensor(found: usize, lines: usize) -> String {
    match found {
        0 => "this file has no frame".to_owned(),
        1..=7 if lines >= 64 => "if it has one pixel a line (a long table), put the 64 of a frame into one line".to_owned(),
        4 => "rows of 4 are those of 4 x 4 pixels, as a D6T has".to_owned(),
        16 | 32 if lines < 8 => sensor_of(found),
        16 | 17 => "16 are the 4 x 4 pixels of a D6T, or a row of 16 x 16, or of 12 x 16, as an MLX90641 has".to_owned(),
        32 => "rows of 32 are those of 24 x 32 pixels, as an MLX90640 has, or of 32 x 32".to_owned(),
        _ => "this file has other rows".to_owned(),
    }
}
