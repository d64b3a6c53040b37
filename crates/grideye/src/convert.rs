//! `grideye convert`: one recording format into another.

use crate::cli::Convert;
use crate::exit::{Outcome, bad_input};
use crate::{count, export, files, progress, recordings};
use anyhow::{Result, anyhow};
use grideye_export::ExportError;
use grideye_export::recording::{Row, Rows};
use grideye_import::{ImportError, Options};
use grideye_inputs::InputError;
use grideye_recording::StreamId;
use std::time::Duration;

pub(crate) fn run(options: &Convert) -> Result<Outcome> {
    files::keep_apart([&options.input], [&options.output])?;
    let mut import = recordings::import(&options.input, &stated(options)?)?;
    let mut labels = import.labels().to_vec();
    let mut counted = None;
    if options.count {
        let mut all: Vec<_> = import.by_ref().collect();
        count::add_people(&mut all, labels.len()).map_err(bad_input)?;
        labels.push("people".to_owned());
        counted = Some(all.into_iter());
    }
    let mut broken = None;
    let mut rows = Asked {
        rows: match &mut counted {
            Some(counted) => counted,
            None => &mut import,
        },
        sensor: options.sensor.as_deref(),
        input: &options.input,
        broken: &mut broken,
    };
    let rows = Rows::of_recording(&labels, &mut rows);
    export::write(rows, &options.output, Some(&options.input))?;
    let tally = import.tally();
    if let Some(tally) = tally {
        progress::say(&tally.to_string());
    }
    if let Some(broken) = &broken {
        let refused = InputError::of_recording(&options.input, broken);
        progress::say(&format!("warning: {refused}"));
    }
    let is_whole = broken.is_none() && !tally.is_some_and(|tally| tally.has_loss());
    Ok(Outcome::told(is_whole))
}

/// The rows of the sensor that was asked for, up to where the file breaks.
struct Asked<'a> {
    rows: &'a mut dyn Iterator<Item = Result<grideye_recording::Row, ImportError>>,
    sensor: Option<&'a str>,
    input: &'a std::path::Path,
    broken: &'a mut Option<ImportError>,
}

impl Iterator for Asked<'_> {
    type Item = Result<Row, ExportError>;

    fn next(&mut self) -> Option<Self::Item> {
        let is_asked = |stream: &StreamId| self.sensor.is_none_or(|sensor| stream.is_of(sensor));
        loop {
            match self.rows.next()? {
                Ok(row) if is_asked(&row.stream) => return Some(Ok(Row::from(row))),
                Ok(_) => {}
                Err(error) if error.is_break() => {
                    *self.broken = Some(error);
                    return None;
                }
                Err(error) => {
                    let refused = InputError::of_recording(self.input, &error);
                    return Some(Err(ExportError::Row(format!("cannot read {refused}"))));
                }
            }
        }
    }
}

fn stated(options: &Convert) -> Result<Options> {
    let columns = options.columns.as_deref().unwrap_or_default();
    let columns = match columns {
        "" => Ok(grideye_import::Columns::default()),
        said => said.parse(),
    };
    Ok(Options {
        columns: columns.map_err(|error: ImportError| bad_input(anyhow!("--columns: {error}")))?,
        period: Duration::try_from_secs_f64(1.0 / options.rate)
            .map_err(|error| bad_input(anyhow!("--rate {}: {error}", options.rate)))?,
    })
}
