//! The errors of an export.

use grideye_frame::word::OutOfRange;
use std::error::Error;
use std::io;
use std::num::TryFromIntError;

/// Why frames cannot be written as a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The frames do not fit the format: why, and a hint.
    #[error("{0}")]
    Frames(String),
    /// A row cannot be read, or exceeds a limit; the message comes from the reader.
    #[error("{0}")]
    Row(String),
    /// A temperature is not a number.
    #[error("a frame contains a temperature that is not a number")]
    NotANumber,
    /// A temperature outside the sensor's range.
    #[error("{what}: {source}")]
    OutOfRange {
        /// What has this temperature.
        what: &'static str,
        /// The temperature.
        source: OutOfRange,
    },
    /// The source of the rows failed.
    #[error(transparent)]
    Source(Box<dyn Error + Send + Sync>),
    /// Writing the file failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A number does not fit the format.
    #[error(transparent)]
    Number(#[from] TryFromIntError),
    /// Encoding an archive of arrays failed.
    #[error(transparent)]
    Zip(#[from] zip::result::ZipError),
    /// Encoding GIF failed.
    #[error(transparent)]
    Gif(#[from] gif::EncodingError),
    /// Encoding Parquet failed.
    #[error(transparent)]
    Parquet(#[from] parquet::errors::ParquetError),
    /// Encoding MCAP failed.
    #[error(transparent)]
    Mcap(#[from] mcap::McapError),
    /// Writing a recording failed.
    #[error(transparent)]
    Recording(#[from] grideye_recording::RecordingError),
}

impl ExportError {
    /// Whether the frames themselves are the cause, so that no other destination would help.
    #[must_use]
    pub const fn is_of_the_frames(&self) -> bool {
        matches!(self, Self::Frames(_) | Self::Row(_))
    }
}
