//! Recordings on disk, whatever their layout.

use crate::exit::bad_input;
use crate::{files, progress};
use anyhow::{Result, anyhow};
use grideye_frame::{PIXELS, RawFrame};
use grideye_recording::bare::{Assumed, NpyReader, RowReader};
use grideye_recording::{Layout, Record, RecordingError, Row, StreamId, csv, linaige, sniff};
use grideye_validator::{Thinned, Thinning};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;

/// The rows of a recording, one by one.
type Rows = Box<dyn Iterator<Item = Result<Row, RecordingError>>>;

/// Opens a recording of any layout that is known; rows come as they are read.
pub(crate) fn open(path: &Path) -> Result<impl Iterator<Item = Result<Row>>> {
    open_assuming(path, None)
}

/// The same, also of a file that leaves open what is stated here.
pub(crate) fn open_assuming(
    path: &Path,
    assumed: Option<&Assumed>,
) -> Result<impl Iterator<Item = Result<Row>> + use<>> {
    let shown = path.display().to_string();
    let rows = rows(path, assumed)?;
    Ok(rows.map(move |row| row.map_err(|error| bad_input(anyhow!("{shown}: {error}")))))
}

/// The whole recording in memory.
pub(crate) fn load(path: &Path) -> Result<Vec<Row>> {
    open(path)?.collect()
}

/// The records of every stream of a recording, in order.
pub(crate) fn load_streams(path: &Path) -> Result<BTreeMap<StreamId, Vec<Record>>> {
    let mut streams: BTreeMap<StreamId, Vec<Record>> = BTreeMap::new();
    for row in open(path)? {
        let row = row?;
        streams.entry(row.stream).or_default().push(row.record);
    }
    Ok(streams)
}

/// The records of a recording that holds one stream, with at least one frame that was read.
pub(crate) fn load_stream(path: &Path) -> Result<Vec<Record>> {
    let mut streams = load_streams(path)?;
    if streams.len() > 1 {
        return Err(several_streams(path, streams.len()));
    }
    let records = streams
        .pop_first()
        .map(|(_, records)| records)
        .unwrap_or_default();
    if records
        .iter()
        .all(|record| record.reading.frame().is_none())
    {
        return Err(no_frame(path));
    }
    Ok(records)
}

/// What is to be looked at of a recording that holds one stream: of a long one not every row, in memory that does not grow
/// with it. At least one frame was read.
pub(crate) fn load_thinned(path: &Path) -> Result<Thinned> {
    let mut thinning = Thinning::default();
    let mut stream = None;
    let mut has_frame = false;
    for row in open(path)? {
        let row = row?;
        if *stream.get_or_insert_with(|| row.stream.clone()) != row.stream {
            return Err(several_streams(path, load_stream_names(path)?.len()));
        }
        has_frame |= row.record.reading.frame().is_some();
        thinning.push(row.record);
    }
    if !has_frame {
        return Err(no_frame(path));
    }
    Ok(thinning.finish())
}

/// The frames of a recording that holds one stream, in order; those that are missing are left out.
pub(crate) fn load_frames(path: &Path) -> Result<Vec<RawFrame>> {
    let records = load_stream(path)?;
    Ok(records
        .iter()
        .filter_map(|record| record.reading.frame().copied())
        .collect())
}

fn load_stream_names(path: &Path) -> Result<BTreeSet<StreamId>> {
    open(path)?.map(|row| Ok(row?.stream)).collect()
}

fn several_streams(path: &Path, streams: usize) -> anyhow::Error {
    bad_input(anyhow!(
        "{} holds {streams} streams, and one is taken at a time\nhint: keep the rows of one device, sensor and boot",
        path.display()
    ))
}

fn no_frame(path: &Path) -> anyhow::Error {
    bad_input(anyhow!(
        "{} holds no frame\nhint: all of its rows say that a frame is missing, or it has no rows; check the sensor's wiring and the agent's log",
        path.display()
    ))
}

fn rows(path: &Path, assumed: Option<&Assumed>) -> Result<Rows> {
    let mut input = files::open(path)?;
    let place = |error: RecordingError| bad_input(anyhow!("{}: {error}", path.display()));
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
            Ok(Box::new(reader.map(|row| row.map(|labelled| labelled.row))))
        }
        Layout::Rows => Ok(Box::new(RowReader::new(input, stated(path, assumed)?))),
        Layout::Npy => {
            let reader = NpyReader::new(input, stated(path, assumed)?).map_err(place)?;
            Ok(Box::new(reader))
        }
    }
}

/// What was stated for a file that says nothing but temperatures.
fn stated(path: &Path, assumed: Option<&Assumed>) -> Result<Assumed> {
    assumed.cloned().ok_or_else(|| {
        bad_input(anyhow!(
            "{0} holds temperatures and no thermistor\nhint: say what it read, and convert the file first: grideye convert {0} recording.csv --thermistor 25",
            path.display()
        ))
    })
}

fn layout(path: &Path, input: &mut BufReader<File>) -> Result<Layout> {
    let beginning = input
        .fill_buf()
        .map_err(|error| bad_input(anyhow!("cannot read {}: {error}", path.display())))?;
    if let Some(pixels) = other_resolution(&header(path)?) {
        return Err(bad_input(anyhow!(
            "{} has {pixels} pixels a frame, a Grid-EYE has 64 (8 x 8)\nhint: only recordings of 8 x 8 pixels are compared and converted; {}",
            path.display(),
            sensor_of(pixels)
        )));
    }
    sniff(beginning).ok_or_else(|| {
        bad_input(anyhow!(
            "{} is no recording that is known here: its first line is none of the headers\nhint: recordings/README.md describes the formats",
            path.display()
        ))
    })
}

/// The first line, as far as a header can be long.
fn header(path: &Path) -> Result<Vec<u8>> {
    let mut line = Vec::new();
    files::open(path)?
        .take(HEADER_BYTES_MAX)
        .read_until(b'\n', &mut line)
        .map_err(|error| bad_input(anyhow!("cannot read {}: {error}", path.display())))?;
    Ok(line)
}

/// The names of the pixels of the largest sensors that are known fit in.
const HEADER_BYTES_MAX: u64 = 1 << 20;

/// The number of pixels that a header names, where it is a recording's header and the number is not a Grid-EYE's.
fn other_resolution(beginning: &[u8]) -> Option<usize> {
    sniff(beginning)?;
    let (line, is_whole) = match beginning.iter().position(|&byte| byte == b'\n') {
        Some(end) => (&beginning[..end], true),
        None => (beginning, false),
    };
    let is_pixel = |name: &&[u8]| {
        let digits = name.trim_ascii().strip_prefix(b"pixel").unwrap_or_default();
        !digits.is_empty() && digits.iter().all(u8::is_ascii_digit)
    };
    let pixels = line.split(|&byte| byte == b',').filter(is_pixel).count();
    // A header that lacks a few columns has a fault, which its reader names.
    let is_other = pixels > PIXELS || (is_whole && pixels > 0 && pixels <= PIXELS / 2);
    is_other.then_some(pixels)
}

/// What is known to have so many pixels.
fn sensor_of(pixels: usize) -> String {
    let known = [
        (16, "4 x 4 pixels, as an Omron D6T-44L"),
        (32, "16 x 2 or 32 x 1 pixels"),
        (192, "16 x 12 pixels, as an MLX90641"),
        (256, "16 x 16 pixels, as an HTPA16x16"),
        (768, "32 x 24 pixels, as an MLX90640"),
        (1_024, "32 x 32 pixels, as an HTPA32x32 or a D6T-32L"),
        (4_800, "80 x 60 pixels, as a Lepton 2"),
        (19_200, "160 x 120 pixels, as a Lepton 3"),
    ];
    let found = known.iter().find(|(number, _)| *number == pixels);
    found.map_or_else(
        || "this one is of another sensor".to_owned(),
        |(_, words)| format!("this one has {words}"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(pixels: usize) -> String {
        let names: String = (0..pixels).map(|index| format!(",pixel{index}")).collect();
        format!("timestamp,thermistor{names},people_number,confidence\n")
    }

    #[test]
    fn the_resolution_of_another_sensor_is_named() {
        assert_eq!(other_resolution(header(64).as_bytes()), None);
        assert_eq!(other_resolution(header(768).as_bytes()), Some(768));
        assert_eq!(other_resolution(header(16).as_bytes()), Some(16));
        assert!(sensor_of(768).contains("32 x 24"));
        // A fault of a Grid-EYE's own header, a header that is cut, and a file of another kind.
        assert_eq!(other_resolution(header(63).as_bytes()), None);
        assert_eq!(other_resolution(&header(64).as_bytes()[..60]), None);
        assert_eq!(other_resolution(b"a,b\n1,2\n"), None);
    }
}
