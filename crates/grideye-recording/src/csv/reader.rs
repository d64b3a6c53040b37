//! Reads a CSV recording.

use crate::cell::{Cell, Column};
use crate::csv::columns::{COLUMNS, LABELS_MAX, Sequences, header, pixel_column};
use crate::error::RecordingError;
use crate::lines::{Line, Lines};
use crate::record::{CLOCK_STATES, Record, Row, Stamp, StreamId};
use crate::text::quoted;
use grideye_frame::{NoData, PIXELS, PixelWord, Reading, RecordedFrame};
use std::io::Read;

/// Reads a recording row by row, as an iterator that ends with the first error.
#[derive(Debug)]
pub struct Reader<R> {
    lines: Lines<R>,
    /// The names of further columns.
    labels: Vec<String>,
    sequences: Sequences,
    ended: bool,
}

impl<R: Read> Reader<R> {
    /// Reads the header at once. Reads in blocks, so the input needs no `BufReader`.
    ///
    /// # Errors
    /// [`RecordingError`] if the first line is not the header of this format.
    pub fn new(input: R) -> Result<Self, RecordingError> {
        let mut lines = Lines::new(input);
        let labels = check_header(&mut lines)?;
        Ok(Self {
            lines,
            labels,
            sequences: Sequences::default(),
            ended: false,
        })
    }

    /// The names of [`Row::labels`].
    #[must_use]
    pub fn labels(&self) -> &[String] {
        &self.labels
    }

    fn row(&mut self) -> Result<Option<Row>, RecordingError> {
        let Some(line) = self.lines.next()? else {
            return Ok(None);
        };
        if !line.ended {
            return Err(line.cut());
        }
        let (line, labels) = line.split_after(COLUMNS, self.labels.len())?;
        let row = Row {
            labels,
            ..parse(&line)?
        };
        self.sequences.admit(line.number, &row)?;
        Ok(Some(row))
    }
}

impl<R: Read> Iterator for Reader<R> {
    type Item = Result<Row, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let item = self.row().transpose();
        self.ended = !matches!(item, Some(Ok(_)));
        item
    }
}

impl<R: Read> std::iter::FusedIterator for Reader<R> {}

/// The names of the columns of labels.
fn check_header<R: Read>(lines: &mut Lines<R>) -> Result<Vec<String>, RecordingError> {
    let header = header();
    let Some(line) = lines.next()? else {
        let what = ": expected a header that begins with device,sensor,boot,seq, found nothing\nhint: the file is empty; its writer stopped before the header";
        return Err(RecordingError::refused(1, what.to_owned()));
    };
    let rest = line
        .text
        .strip_prefix(header.as_str())
        .and_then(|rest| match rest {
            "" => Some(Vec::new()),
            rest => Some(
                rest.strip_prefix(',')?
                    .split(',')
                    .map(str::to_owned)
                    .collect(),
            ),
        });
    if let Some(names) = rest.filter(|names| names.len() <= LABELS_MAX) {
        return if line.ended {
            Ok(names)
        } else {
            Err(line.cut())
        };
    }
    if !line.ended && header.starts_with(line.text) {
        return Err(line.cut());
    }
    let mut found = line.text.split(',');
    let mut expected = header.split(',');
    let mut field = 1;
    loop {
        match (expected.next(), found.next()) {
            (Some(expected), Some(found)) if expected == found => field += 1,
            (expected, found) => {
                let expected = expected.unwrap_or("none: the line ends here");
                let found = found.map_or("the end of the line".to_owned(), quoted);
                let what = format!(
                    ", field {field}: expected the column name {expected}, found {found}\nhint: recordings/README.md states the columns of each layout"
                );
                return Err(RecordingError::refused(1, what));
            }
        }
    }
}

fn parse(line: &Line<'_>) -> Result<Row, RecordingError> {
    let [
        device,
        sensor,
        boot,
        seq,
        t_boot,
        t_utc,
        clock,
        t_arrival,
        missing,
        thermistor,
        pixels @ ..,
    ] = line.fields::<COLUMNS>()?;
    let cell = |name, text| Cell {
        line: line.number,
        column: Column::Named(name),
        text,
    };
    let stream = StreamId {
        device: cell("device", device).name()?,
        sensor: cell("sensor", sensor).name()?,
        boot: cell("boot", boot).name()?,
    };
    let clock = cell("clock", clock);
    let record = Record {
        seq: cell("seq", seq).count()?,
        stamp: Stamp {
            t_boot_ns: cell("t_boot_ns", t_boot).count()?,
            t_utc_ns: cell("t_utc_ns", t_utc).nanoseconds()?,
            clock: clock
                .text
                .parse()
                .ok()
                .ok_or_else(|| clock.refused(CLOCK_STATES))?,
        },
        reading: reading(line.number, missing, thermistor, pixels)?,
    };
    let t_arrival_ns = match t_arrival {
        "" => None,
        arrival => Some(cell("t_arrival_ns", arrival).nanoseconds()?),
    };
    Ok(Row {
        stream,
        record,
        t_arrival_ns,
        labels: Vec::new(),
    })
}

fn reading(
    line: u64,
    missing: &str,
    thermistor: &str,
    pixels: [&str; PIXELS],
) -> Result<Reading<RecordedFrame>, RecordingError> {
    let cell = |column, text| Cell { line, column, text };
    let thermistor = cell(Column::Named("thermistor"), thermistor);
    let pixels = pixels.into_iter().enumerate();
    let pixels = pixels.map(|(index, text)| cell(pixel_column(index), text));
    if missing.is_empty() {
        let mut frame = RecordedFrame {
            thermistor: match thermistor.text {
                "" => None,
                _ => Some(thermistor.thermistor()?),
            },
            pixels: [PixelWord(0); PIXELS],
        };
        for (word, cell) in frame.pixels.iter_mut().zip(pixels) {
            *word = cell.pixel()?;
        }
        return Ok(Reading::Frame(frame));
    }
    let reason: NoData = missing.parse().ok().ok_or_else(|| {
        let names: Vec<_> = NoData::ALL.iter().map(|reason| reason.name()).collect();
        let expected = format!("nothing, or one of {}", names.join(" "));
        cell(Column::Named("missing"), missing).refused(expected)
    })?;
    match [thermistor]
        .into_iter()
        .chain(pixels)
        .find(|cell| !cell.text.is_empty())
    {
        None => Ok(Reading::NoData(reason)),
        Some(full) => Err(full.refused(format!(
            "an empty cell, since the frame is missing ({reason})"
        ))),
    }
}
