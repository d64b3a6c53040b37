//! Writes a CSV recording.

use crate::cell::{Cell, Column};
use crate::csv::columns::{LABELS_MAX, Sequences, header, label};
use crate::error::RecordingError;
use crate::record::{COUNT_MAX, Record, Row, StreamId};
use core::fmt::Write as _;
use grideye_frame::word;
use grideye_frame::{NoData, PIXELS, Reading, RecordedFrame};
use std::io::Write;

/// Writes a recording row by row, each in one `write_all`, so that a killed program leaves at most one cut row. Call
/// [`Writer::finish`] at the end.
#[derive(Debug)]
pub struct Writer<W> {
    output: W,
    /// The row being composed, reused for its memory.
    buffer: String,
    sequences: Sequences,
    /// Further columns.
    labels: usize,
    lines: u64,
    broken_at: Option<u64>,
}

impl<W: Write> Writer<W> {
    /// Writes the header at once, so that a recording without frames is valid too.
    ///
    /// # Errors
    /// [`RecordingError::Io`] if the header cannot be written.
    pub fn new(output: W) -> Result<Self, RecordingError> {
        Self::with_labels(output, &[])
    }

    /// The same with further columns for [`Row::labels`], as many in each row.
    ///
    /// # Errors
    /// The same.
    pub fn with_labels(output: W, labels: &[String]) -> Result<Self, RecordingError> {
        let labels = &labels[..labels.len().min(LABELS_MAX)];
        let names = labels.iter().map(|name| format!(",{}", label(name)));
        let mut writer = Self {
            output,
            buffer: header() + &names.collect::<String>(),
            labels: labels.len(),
            sequences: Sequences::default(),
            lines: 0,
            broken_at: None,
        };
        writer.send_line()?;
        Ok(writer)
    }

    /// Writes one row. The upper four bits of a word are lost: the datasheet leaves them unspecified, and degrees
    /// cannot hold them.
    ///
    /// # Errors
    /// [`RecordingError`] for a row that a [`Reader`](super::Reader) would reject; after [`RecordingError::Io`] every
    /// call fails.
    pub fn write(&mut self, row: &Row) -> Result<(), RecordingError> {
        self.check_whole()?;
        let line = self.lines + 1;
        check_stream(line, &row.stream)?;
        check_count(line, "seq", row.record.seq)?;
        check_count(line, "t_boot_ns", row.record.stamp.t_boot_ns)?;
        self.sequences.admit(line, row)?;
        self.buffer.clear();
        compose(&mut self.buffer, row);
        for index in 0..self.labels {
            self.buffer.push(',');
            let text = row.labels.get(index).map_or("", String::as_str);
            self.buffer.push_str(&label(text));
        }
        self.send_line()
    }

    /// Flushes and returns the output.
    ///
    /// # Errors
    /// [`RecordingError::Io`] if flushing fails, and an error if an earlier row could not be written.
    pub fn finish(mut self) -> Result<W, RecordingError> {
        self.check_whole()?;
        let line = self.lines;
        self.output
            .flush()
            .map_err(|source| RecordingError::Io { line, source })?;
        Ok(self.output)
    }

    /// If writing an earlier row failed, the file ends there.
    fn check_whole(&self) -> Result<(), RecordingError> {
        let what = ": expected an intact file, found one with a failed last row";
        self.broken_at.map_or(Ok(()), |line| {
            Err(RecordingError::refused(line, what.to_owned()))
        })
    }

    /// The output, for example to take its content; do not write to it.
    pub const fn output_mut(&mut self) -> &mut W {
        &mut self.output
    }

    /// Rows written so far.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.lines.saturating_sub(1)
    }

    fn send_line(&mut self) -> Result<(), RecordingError> {
        let line = self.lines + 1;
        self.buffer.push('\n');
        match self.output.write_all(self.buffer.as_bytes()) {
            Ok(()) => {
                self.lines = line;
                Ok(())
            }
            Err(source) => {
                self.broken_at = Some(line);
                Err(RecordingError::Io { line, source })
            }
        }
    }
}

fn check_stream(line: u64, stream: &StreamId) -> Result<(), RecordingError> {
    let named = [
        ("device", &stream.device),
        ("sensor", &stream.sensor),
        ("boot", &stream.boot),
    ];
    for (column, text) in named {
        let column = Column::Named(column);
        Cell { line, column, text }.name()?;
    }
    Ok(())
}

fn check_count(line: u64, column: &str, count: u64) -> Result<(), RecordingError> {
    if count <= COUNT_MAX {
        return Ok(());
    }
    let expected = format!("an integer from 0 to {COUNT_MAX}");
    Err(RecordingError::cell(
        line,
        column,
        &expected,
        &count.to_string(),
    ))
}

/// Appends the row without its newline. Writing to a `String` cannot fail.
fn compose(text: &mut String, row: &Row) {
    let StreamId {
        device,
        sensor,
        boot,
    } = &row.stream;
    let Record {
        seq,
        stamp,
        reading,
    } = &row.record;
    let _ = write!(
        text,
        "{device},{sensor},{boot},{seq},{},{},{},",
        stamp.t_boot_ns, stamp.t_utc_ns, stamp.clock
    );
    if let Some(arrival) = row.t_arrival_ns {
        let _ = write!(text, "{arrival}");
    }
    match reading {
        Reading::Frame(frame) => compose_frame(text, frame),
        Reading::NoData(reason) => compose_missing(text, *reason),
    }
}

fn compose_frame(text: &mut String, raw: &RecordedFrame) {
    text.push_str(",,");
    // The shortest decimal is exact here, because every step is a power of two.
    if let Some(thermistor) = raw.thermistor {
        let _ = write!(text, "{}", word::thermistor_celsius(thermistor));
    }
    for pixel in word::pixels(&raw.pixels) {
        let _ = write!(text, ",{pixel}");
    }
}

fn compose_missing(text: &mut String, reason: NoData) {
    let _ = write!(text, ",{reason},");
    text.extend(core::iter::repeat_n(',', PIXELS));
}
