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
    /// The file is no recording, or nobody can tell what its columns are: what, and what to do.
    #[error("{}\nhint: {}", printable(what), printable(hint))]
    Refused {
        /// What is wrong.
        what: String,
        /// What to do.
        hint: String,
    },
}

impl ImportError {
    /// What could not be read there, or is more than the file may become.
    pub(crate) fn unread(place: impl Into<String>, error: &io::Error) -> Self {
        if error.kind() != io::ErrorKind::FileTooLarge {
            return Self::broken(place, error.to_string());
        }
        let hint = "if it is what you recorded, unpack it or save it as plain CSV, which is read line by line and may have any length";
        Self::refused(format!("{}: it becomes {error}", place.into()), hint)
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

    /// No row has the numbers of a frame: the most in a row, and how many rows have as many.
    pub(crate) fn no_frame(found: usize, lines: usize) -> Self {
        let what = format!("expected rows of 64 numbers, found {found} at most");
        let sensor = sensor(found, lines);
        let hint =
            format!("a frame is 64 numbers in a row, a list or eight lines of eight; {sensor}");
        Self::refused(what, hint)
    }

    /// Frames of so many pixels.
    pub(crate) fn other_sensor(found: usize) -> Self {
        let what = format!("{found} pixels a frame, a Grid-EYE has 64 (8 x 8)");
        let sensor = sensor_of(found);
        let hint = format!("only recordings of 8 x 8 pixels are compared and converted; {sensor}");
        Self::refused(what, hint)
    }

    pub(crate) fn unlike(
        expected: &str,
        found: impl std::fmt::Display,
        hint: impl Into<String>,
    ) -> Self {
        Self::refused(format!("expected {expected}, found {found}"), hint)
    }

    pub(crate) fn refused(what: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Refused {
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
