//! Recordings on disk, whatever their layout.

use crate::exit::bad_input;
use crate::{files, progress};
use anyhow::{Result, anyhow};
use grideye_recording::bare::{Assumed, NpyReader, RowReader};
use grideye_recording::{
    Layout, Record, RecordingError, Row, StreamId, csv, linaige, other_resolution, sensor_of, sniff,
};
use grideye_validator::{Thinned, Thinning};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;

type Rows = Box<dyn Iterator<Item = Result<Row, RecordingError>>>;

/// Opens a recording of any known layout; rows arrive as they are read.
pub(crate) fn open(path: &Path) -> Result<impl Iterator<Item = Result<Row>>> {
    open_assuming(path, None)
}

/// The same, with the facts that a bare file lacks.
pub(crate) fn open_assuming(
    path: &Path,
    assumed: Option<&Assumed>,
) -> Result<impl Iterator<Item = Result<Row>> + use<>> {
    let shown = path.display().to_string();
    let rows = rows(path, assumed)?;
    Ok(rows.map(move |row| row.map_err(|error| refused(&shown, &error))))
}

/// Adds the file's name, and a hint unless the error has one.
fn refused(shown: impl Display, error: &RecordingError) -> anyhow::Error {
    let told = error.to_string();
    let hint = match told.contains("\nhint: ") {
        true => "",
        false => "\nhint: correct or delete this row; recordings/README.md describes the format",
    };
    bad_input(anyhow!("{shown}: {told}{hint}"))
}

pub(crate) fn load_streams(path: &Path) -> Result<BTreeMap<StreamId, Vec<Record>>> {
    let mut streams: BTreeMap<StreamId, Vec<Record>> = BTreeMap::new();
    for row in open(path)? {
        let row = row?;
        streams.entry(row.stream).or_default().push(row.record);
    }
    Ok(streams)
}

/// The records of a recording with one stream and at least one frame.
pub(crate) fn load_stream(path: &Path) -> Result<Vec<Record>> {
    let mut records = Vec::new();
    one_stream(path, |record| records.push(record))?;
    Ok(records)
}

/// The same, thinned if it is long, so that memory does not grow with it.
pub(crate) fn load_thinned(path: &Path) -> Result<Thinned> {
    let mut thinning = Thinning::default();
    one_stream(path, |record| thinning.push(record))?;
    Ok(thinning.finish())
}

fn one_stream(path: &Path, mut take: impl FnMut(Record)) -> Result<()> {
    let (mut stream, mut has_frame) = (None, false);
    for row in open(path)? {
        let row = row?;
        if *stream.get_or_insert_with(|| row.stream.clone()) != row.stream {
            let streams: BTreeSet<StreamId> = open(path)?
                .map(|row| Ok(row?.stream))
                .collect::<Result<_>>()?;
            return Err(bad_input(anyhow!(
                "{} holds {} streams, and one is taken at a time\nhint: keep the rows of one device, sensor and boot",
                path.display(),
                streams.len()
            )));
        }
        has_frame |= row.record.reading.frame().is_some();
        take(row.record);
    }
    if !has_frame {
        return Err(bad_input(anyhow!(
            "{} holds no frame\nhint: all of its rows say that a frame is missing, or it has no rows; check the sensor's wiring and the agent's log",
            path.display()
        )));
    }
    Ok(())
}

fn rows(path: &Path, assumed: Option<&Assumed>) -> Result<Rows> {
    let mut input = files::open(path)?;
    let place = |error: RecordingError| refused(path.display(), &error);
    let layout = layout(path, &mut input)?;
    let bytes = input.get_ref().metadata().map_or(0, |about| about.len());
    let input = progress::reading(input, bytes);
    match layout {
        Layout::Recording => Ok(Box::new(csv::Reader::new(input).map_err(place)?)),
        Layout::Linaige => {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let date = linaige::Date::from_file_name(&name).map_err(place)?;
            let stream = linaige::stream_from_file_name(&name);
            let reader = linaige::Reader::new(input, date, stream).map_err(place)?;
            Ok(Box::new(reader.map(|row| row.map(|labeled| labeled.row))))
        }
        Layout::Rows => Ok(Box::new(RowReader::new(input, stated(path, assumed)?))),
        Layout::Npy => {
            let reader = NpyReader::new(input, stated(path, assumed)?).map_err(place)?;
            Ok(Box::new(reader))
        }
    }
}

fn stated(path: &Path, assumed: Option<&Assumed>) -> Result<Assumed> {
    assumed.cloned().ok_or_else(|| {
        bad_input(anyhow!(
            "{0} holds temperatures and no thermistor\nhint: say what it read, and convert the file first: grideye convert {0} recording.csv --thermistor 25",
            path.display()
        ))
    })
}

/// Fits the pixel names of the largest known sensors.
const HEADER_BYTES_MAX: u64 = 1 << 20;

fn layout(path: &Path, input: &mut BufReader<File>) -> Result<Layout> {
    let shown = path.display();
    let unread = |error| {
        bad_input(anyhow!(
            "cannot read {shown}: {error}\nhint: name a file that you may read"
        ))
    };
    let beginning = input.fill_buf().map_err(unread)?;
    // The first line, up to the longest header.
    let mut header = Vec::new();
    let mut lines = files::open(path)?.take(HEADER_BYTES_MAX);
    lines.read_until(b'\n', &mut header).map_err(unread)?;
    if let Some(pixels) = other_resolution(&header) {
        return Err(bad_input(anyhow!(
            "{shown} has {pixels} pixels a frame, a Grid-EYE has 64 (8 x 8)\nhint: only recordings of 8 x 8 pixels are compared and converted; {}",
            sensor_of(pixels)
        )));
    }
    sniff(beginning).ok_or_else(|| {
        bad_input(anyhow!(
            "{shown} is no recording that is known here: its first line is none of the headers\nhint: recordings/README.md describes the formats"
        ))
    })
}
