//! Why frames cannot be written as a file.

use amg8833::word::OutOfRange;
use std::error::Error;
use std::io;
use std::num::TryFromIntError;

/// Why frames cannot be written as a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A film is longer than an archive for numpy can be.
    #[error(
        "{frames} frames of {pixels} pixels are more than an .npz archive of 4 GB holds\nhint: write at most {frames_max} with --frames"
    )]
    LongFilm {
        /// Frames of the film.
        frames: u64,
        /// Pixels of each.
        pixels: u64,
        /// Frames of that size that an archive holds.
        frames_max: u64,
    },
    /// A recording is longer than an archive for numpy can be.
    #[error(
        "the recording has more than the {rows_max} rows that an .npz archive of 4 GB holds\nhint: write .parquet, which has no such limit"
    )]
    LongRecording {
        /// Rows that an archive holds.
        rows_max: usize,
    },
    /// A picture of a recording in which no frame was read.
    #[error(
        "the recording holds no frame\nhint: all of its rows say that a frame is missing, or it has no rows"
    )]
    NoFrame,
    /// A picture of several sensors or boots.
    #[error(
        "the recording holds several streams, and a picture shows one\nhint: choose one with --sensor, for example --sensor {device}/{sensor}"
    )]
    SeveralStreams {
        /// The device of one of them.
        device: String,
        /// The sensor of the same.
        sensor: String,
    },
    /// A row that cannot be read, or is one too many, in the words of whoever reads them.
    #[error("{0}")]
    Row(String),
    /// A temperature that is no number.
    #[error("a frame that is no number")]
    NotANumber,
    /// A temperature that the sensor has no word for.
    #[error("{what}: {source}")]
    OutOfRange {
        /// Whose temperature.
        what: &'static str,
        /// Which.
        source: OutOfRange,
    },
    /// What the rows come from failed.
    #[error(transparent)]
    Source(Box<dyn Error + Send + Sync>),
    /// The file takes nothing.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A number that the format has no room for.
    #[error(transparent)]
    Number(#[from] TryFromIntError),
    /// The writer of GIF failed.
    #[error(transparent)]
    Gif(#[from] gif::EncodingError),
    /// The writer of Parquet failed.
    #[error(transparent)]
    Parquet(#[from] parquet::errors::ParquetError),
    /// The writer of MCAP failed.
    #[error(transparent)]
    Mcap(#[from] mcap::McapError),
    /// The writer of recordings failed.
    #[error(transparent)]
    Recording(#[from] grideye_recording::RecordingError),
}

impl ExportError {
    /// Whether these frames cannot be written in this format, wherever to.
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
