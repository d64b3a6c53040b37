use super::columns::{LEADING, pixel_column};
use crate::cell::{Cell, Column};
use crate::csv::columns::{COLUMNS, header};
use crate::csv::sequences::Sequences;
use crate::error::RecordingError;
use crate::lines::{Line, Lines};
use crate::record::Row;
use crate::record::{CLOCK_STATES, Record, Stamp, StreamId};
use crate::rows::rows_until_error;
use crate::text::quoted;
use grideye_frame::{NoData, PIXELS, PixelWord, RawFrame, Reading};
use std::io::Read;

/// Reads a recording row by row, as an iterator.
///
/// The first error is the last item: what follows a damaged row is not to be relied on.
pub struct Reader<R> {
    lines: Lines<R>,
    sequences: Sequences,
    ended: bool,
}

impl<R: Read> Reader<R> {
    /// Reads the header at once, so that a file of another kind is refused before anything is done with it. Reads in
    /// blocks: a `BufReader` around the input is not needed.
    ///
    /// # Errors
    ///
    /// [`RecordingError`] if the first line is not the header of this format.
    pub fn new(input: R) -> Result<Self, RecordingError> {
        let mut lines = Lines::new(input);
        check_header(&mut lines, &header(), "device,sensor,boot,seq")?;
        Ok(Self {
            lines,
            sequences: Sequences::default(),
            ended: false,
        })
    }

    fn row(&mut self) -> Result<Option<Row>, RecordingError> {
        let Some(line) = self.lines.next()? else {
            return Ok(None);
        };
        if !line.ended {
            return Err(line.cut());
        }
        let row = parse(&line)?;
        self.sequences.admit(line.number, &row)?;
        Ok(Some(row))
    }
}

rows_until_error!(Reader, Row);

impl<R> core::fmt::Debug for Reader<R> {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter
            .debug_struct("Reader")
            .field("sequences", &self.sequences)
            .field("ended", &self.ended)
            .finish_non_exhaustive()
    }
}

/// Reads the first line and holds it against a layout's.
pub(crate) fn check_header<R: Read>(
    lines: &mut Lines<R>,
    header: &str,
    beginning: &'static str,
) -> Result<(), RecordingError> {
    let Some(line) = lines.next()? else {
        return Err(RecordingError::Empty {
            expected: beginning,
        });
    };
    if line.text == header {
        return if line.ended { Ok(()) } else { Err(line.cut()) };
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
                return Err(RecordingError::UnknownHeader {
                    field,
                    expected: expected.unwrap_or("none: the line ends here").to_owned(),
                    found: found.map_or("the end of the line".to_owned(), quoted),
                });
            }
        }
    }
}

fn parse(line: &Line<'_>) -> Result<Row, RecordingError> {
    let fields: [&str; COLUMNS] = line.fields()?;
    let (leading, pixels) = fields.split_at(LEADING.len());
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
    ] = leading
    else {
        return Err(RecordingError::FieldCount {
            line: line.number,
            expected: COLUMNS,
            found: leading.len(),
        });
    };
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
    let t_arrival_ns = match *t_arrival {
        "" => None,
        arrival => Some(cell("t_arrival_ns", arrival).nanoseconds()?),
    };
    Ok(Row {
        stream,
        record,
        t_arrival_ns,
    })
}

fn reading(
    line: u64,
    missing: &str,
    thermistor: &str,
    pixels: &[&str],
) -> Result<Reading<RawFrame>, RecordingError> {
    if !missing.is_empty() {
        return no_data(line, missing, thermistor, pixels).map(Reading::NoData);
    }
    let mut frame = RawFrame {
        thermistor: Cell {
            line,
            column: Column::Named("thermistor"),
            text: thermistor,
        }
        .thermistor()?,
        pixels: [PixelWord(0); PIXELS],
    };
    for (index, (word, text)) in frame.pixels.iter_mut().zip(pixels).enumerate() {
        *word = Cell {
            line,
            column: pixel_column(index),
            text,
        }
        .pixel()?;
    }
    Ok(Reading::Frame(frame))
}

fn no_data(
    line: u64,
    missing: &str,
    thermistor: &str,
    pixels: &[&str],
) -> Result<NoData, RecordingError> {
    let cell = Cell {
        line,
        column: Column::Named("missing"),
        text: missing,
    };
    let reason = missing.parse().ok().ok_or_else(|| {
        let names: Vec<_> = NoData::ALL.iter().map(|reason| reason.name()).collect();
        cell.refused(format!("nothing, or one of {}", names.join(" ")))
    })?;
    let empty = |column, text: &str| match text {
        "" => Ok(()),
        _ => Err(Cell { line, column, text }.refused(format!(
            "an empty cell, since the frame is missing ({reason})"
        ))),
    };
    empty(Column::Named("thermistor"), thermistor)?;
    for (index, text) in pixels.iter().enumerate() {
        empty(pixel_column(index), text)?;
    }
    Ok(reason)
}
