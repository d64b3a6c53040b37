//! The errors of an export.

use grideye_frame::word::OutOfRange;
use std::error::Error;
use std::io;
use std::num::TryFromIntError;

/// Why frames cannot be written as a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// More frames than a format holds in memory.
    #[error(
        "more than {frames_max} frames do not fit into such a file\nhint: write .parquet, which has no such limit"
    )]
    TooLong {
        /// Frames of that size that fit.
        frames_max: usize,
    },
    /// No frame to draw.
    #[error(
        "the recording holds no frame\nhint: all of its rows say that a frame is missing, or it has no rows"
    )]
    NoFrame,
    /// An image of several sensors or boots.
    #[error(
        "the recording holds several streams, but an image shows only one\nhint: choose one with --sensor, for example --sensor {device}/{sensor}"
    )]
    SeveralStreams {
        /// The device of one of the streams.
        device: String,
        /// The sensor of that stream.
        sensor: String,
    },
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
        matches!(
            self,
            Self::TooLong { .. } | Self::NoFrame | Self::SeveralStreams { .. } | Self::Row(_)
        )
    }
}
