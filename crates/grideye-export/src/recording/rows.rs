//! The rows of a recording or a simulation, and the file they are written to.

use crate::error::ExportError;
use grideye_frame::word;
use grideye_frame::{COLUMNS, Celsius, NoData, PIXELS, PixelWord, ROWS, Reading, RecordedFrame};
use grideye_recording::{self as recording, Record, Stamp, StreamId};
use std::io::{Seek, Write};

/// One frame of a sensor of any size, in degrees.
#[derive(Debug)]
pub struct Row {
    /// The frame's stream.
    pub stream: StreamId,
    /// Its number.
    pub seq: u64,
    /// When it was read.
    pub stamp: Stamp,
    /// When it arrived, nanoseconds since 1970-01-01 UTC, if known.
    pub t_arrival_ns: Option<i64>,
    /// What else is known of it: one text for each of the rows' labels.
    pub labels: Vec<String>,
    /// The thermistor, °C, if known.
    pub thermistor_c: Option<f32>,
    /// The pixels, °C, row by row from the top left, or why there are none.
    pub pixels_c: Result<Vec<f32>, NoData>,
}

impl Row {
    /// Why there is no frame.
    pub(super) fn missing(&self) -> Option<&'static str> {
        self.pixels_c.as_ref().err().map(|reason| reason.name())
    }
}

impl From<recording::Row> for Row {
    fn from(row: recording::Row) -> Self {
        let frame = row.record.reading.frame();
        let thermistor = frame.and_then(|frame| frame.thermistor);
        Self {
            thermistor_c: thermistor.map(|word| word::thermistor_celsius(word).get()),
            pixels_c: match row.record.reading {
                Reading::Frame(frame) => Ok(word::pixels(&frame.pixels).map(Celsius::get).into()),
                Reading::NoData(reason) => Err(reason),
            },
            stream: row.stream,
            seq: row.record.seq,
            stamp: row.record.stamp,
            t_arrival_ns: row.t_arrival_ns,
            labels: row.labels,
        }
    }
}

/// As the sensor would have made it, in its own steps. A row of a recording becomes what it was, but for the upper four bits
/// of its words.
impl TryFrom<Row> for recording::Row {
    type Error = ExportError;

    fn try_from(row: Row) -> Result<Self, ExportError> {
        let out_of_range = |what| move |source| ExportError::OutOfRange { what, source };
        let reading = match row.pixels_c {
            Ok(pixels_c) => {
                let mut pixels = [PixelWord::default(); PIXELS];
                for (word, celsius) in pixels.iter_mut().zip(pixels_c) {
                    *word =
                        word::pixel_word(Celsius::new(celsius)).map_err(out_of_range("a pixel"))?;
                }
                let thermistor = row.thermistor_c.map(Celsius::new);
                let thermistor = thermistor.map(word::thermistor_word).transpose();
                let thermistor = thermistor.map_err(out_of_range("the sensor's temperature"))?;
                Reading::Frame(RecordedFrame { thermistor, pixels })
            }
            Err(reason) => Reading::NoData(reason),
        };
        Ok(Self {
            stream: row.stream,
            record: Record {
                seq: row.seq,
                stamp: row.stamp,
                reading,
            },
            t_arrival_ns: row.t_arrival_ns,
            labels: row.labels,
        })
    }
}

/// Rows, read or simulated one by one.
pub struct Rows<'a> {
    /// Columns and rows of a frame.
    pub size: (usize, usize),
    /// What is known of all of them, as JSON; kept in `.npz` and `.parquet`.
    pub about: Option<String>,
    /// The names of the rows' labels.
    pub labels: &'a [String],
    /// The rows.
    pub rows: &'a mut dyn Iterator<Item = Result<Row, ExportError>>,
}

impl<'a> Rows<'a> {
    /// The rows of a recording.
    pub fn of_recording(
        labels: &'a [String],
        rows: &'a mut dyn Iterator<Item = Result<Row, ExportError>>,
    ) -> Self {
        Self {
            size: (COLUMNS, ROWS),
            about: None,
            labels,
            rows,
        }
    }

    /// Whether a recording can hold the frames.
    #[must_use]
    pub fn are_of_a_grid_eye(&self) -> bool {
        self.size == (COLUMNS, ROWS)
    }
}

impl Iterator for Rows<'_> {
    type Item = Result<Row, ExportError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.rows.next()
    }
}

/// Refuses more frames than a format holds in memory.
pub(super) fn check_length(frames: usize, size: (usize, usize)) -> Result<(), ExportError> {
    let frames_max = FRAME_BYTES_MAX / (size.0 * size.1 * size_of::<f32>()).max(1);
    if frames <= frames_max {
        return Ok(());
    }
    Err(ExportError::Frames(format!(
        "more than {frames_max} frames do not fit into such a file\nhint: write .parquet, which has no such limit"
    )))
}

/// Maximum bytes of frames in memory, with which an archive stays below the 4 GB of zip without extensions.
const FRAME_BYTES_MAX: usize = 1 << 31;

/// A file being written.
pub trait Out: Write + Seek + Send {}

impl<T: Write + Seek + Send> Out for T {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_frames_than_memory_holds_are_refused_with_the_number_that_fits() {
        let error = check_length(16_100_000, (8, 8)).unwrap_err();
        assert!(
            error.to_string().contains("more than 8388608 frames"),
            "{error}"
        );
        check_length(8_388_608, (8, 8)).unwrap();
        check_length(111_848, (80, 60)).unwrap();
        check_length(111_849, (80, 60)).unwrap_err();
    }
}
