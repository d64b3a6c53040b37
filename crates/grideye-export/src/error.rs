//! The errors of an export.

use amg8833::word::OutOfRange;
use std::error::Error;
use std::io;
use std::num::TryFromIntError;

/// Why frames cannot be written as a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A film exceeds the size of an .npz archive.
    #[error(
        "{frames} frames of {pixels} pixels are more than an .npz archive of 4 GB holds\nhint: write at most {frames_max} with --frames"
    )]
    LongFilm {
        /// Frames of the film.
        frames: u64,
        /// Pixels of each.
        pixels: u64,
        /// Frames of that size that fit.
        frames_max: u64,
    },
    /// A recording exceeds the size of an .npz archive.
    #[error(
        "the recording has more than the {rows_max} rows that an .npz archive of 4 GB holds\nhint: write .parquet, which has no such limit"
    )]
    LongRecording {
        /// Rows that fit.
        rows_max: usize,
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
            Self::LongFilm { .. }
                | Self::LongRecording { .. }
                | Self::NoFrame
                | Self::SeveralStreams { .. }
                | Self::Row(_)
        )
    }
}
