//! Recordings on disk, whatever their layout.

use crate::exit::bad_input;
use crate::{files, progress};
use anyhow::{Result, anyhow};
use grideye_import::{Import, ImportError, Options, Tally};
use grideye_inputs::{InputError, shown};
use grideye_recording::{Record, Row, StreamId, level};
use grideye_rig::SELF_HEATING_C;
use grideye_validator::{Thinned, Thinning};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Opens a recording of any layout; rows arrive as they are read.
pub(crate) fn open(path: &Path) -> Result<impl Iterator<Item = Result<Row>> + use<>> {
    let path = path.to_owned();
    let mut import = import(&path, &Options::default()).map_err(|error| {
        // Only one command takes the option that such an error asks for.
        match error.to_string().contains("--columns") {
            true => bad_input(anyhow!(
                "{error}; grideye convert FILE recording.csv takes --columns, and what it writes is read here"
            )),
            false => error,
        }
    })?;
    Ok(std::iter::from_fn(move || {
        let row = import.next();
        if let (None, Some(tally)) = (&row, import.tally().filter(Tally::has_loss)) {
            progress::say(&format!("{}: {tally}", shown(&path)));
        }
        row.map(|row| row.map_err(|error| refused(&path, &error)))
    }))
}

/// The same with what is said about the file. Prints what was taken for what, unless the layout says it.
pub(crate) fn import(path: &Path, options: &Options) -> Result<Import> {
    let input = files::open(path)?;
    let bytes = input.get_ref().metadata().map_or(0, |about| about.len());
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let import = grideye_import::open(progress::reading(input, bytes), &name, options);
    let import = import.map_err(|error| refused(path, &error))?;
    if import.tally().is_some() {
        progress::say(&format!("{}: {}", shown(path), import.account()));
    }
    Ok(import)
}

fn refused(path: &Path, error: &ImportError) -> anyhow::Error {
    bad_input(InputError::of_recording(path, error))
}

/// Says what a replay shows in the place of a thermistor that was not recorded.
pub(crate) fn say_what_stands_for_the_thermistor<'r>(
    records: impl IntoIterator<Item = &'r Record>,
) {
    let mut frames = records
        .into_iter()
        .filter_map(|record| record.reading.frame());
    if frames.any(|frame| frame.thermistor.is_none()) {
        progress::say(&format!(
            "the recording has no thermistor: its register shows the mean of the pixels plus {SELF_HEATING_C} °C"
        ));
    }
}

/// Says that a recording's values are hardly degrees Celsius.
pub(crate) fn say_doubt<'r>(path: &Path, records: impl IntoIterator<Item = &'r Record>) {
    if let Some(doubt) = level::doubt_of(records) {
        progress::say(&format!("warning: {}: {doubt}", shown(path)));
    }
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
    with_frames(path, |record| records.push(record))?;
    Ok(records)
}

/// The same, thinned if it is long, so that memory does not grow with it.
pub(crate) fn load_thinned(path: &Path) -> Result<Thinned> {
    let mut thinning = Thinning::default();
    with_frames(path, |record| thinning.push(record))?;
    Ok(thinning.finish())
}

fn with_frames(path: &Path, mut take: impl FnMut(Record)) -> Result<()> {
    let mut has_frame = false;
    one_stream(path, |record| {
        has_frame |= record.reading.frame().is_some();
        take(record);
        Ok(())
    })?;
    if !has_frame {
        return Err(bad_input(anyhow!(
            "{} holds no frame\nhint: all of its rows say that a frame is missing, or it has no rows; check the sensor's wiring and the agent's log",
            shown(path)
        )));
    }
    Ok(())
}

/// Hands over the records of a recording with one stream, as they are read.
pub(crate) fn one_stream(path: &Path, mut take: impl FnMut(Record) -> Result<()>) -> Result<()> {
    let mut stream = None;
    for row in open(path)? {
        let row = row?;
        if *stream.get_or_insert_with(|| row.stream.clone()) != row.stream {
            let streams: BTreeSet<StreamId> = open(path)?
                .map(|row| Ok(row?.stream))
                .collect::<Result<_>>()?;
            return Err(bad_input(anyhow!(
                "{} holds {} streams, and one is taken at a time\nhint: keep the rows of one device, sensor and boot",
                shown(path),
                streams.len()
            )));
        }
        take(row.record)?;
    }
    Ok(())
}
