//! `grideye convert`: one recording format into another.

use crate::cli::Convert;
use crate::exit::{Outcome, bad_input};
use crate::{export, files, recordings};
use amg8833::word;
use anyhow::{Result, anyhow};
use grideye_export::ExportError;
use grideye_frame::Celsius;
use grideye_recording::bare::Assumed;
use grideye_recording::{Row, StreamId, linaige};
use std::time::Duration;

pub(crate) fn run(options: &Convert) -> Result<Outcome> {
    files::keep_apart([&options.input], [&options.output])?;
    let asked = |row: &Result<Row>| match (&options.sensor, row) {
        (Some(sensor), Ok(row)) => {
            sensor == &row.stream.sensor
                || sensor == &format!("{}/{}", row.stream.device, row.stream.sensor)
        }
        _ => true,
    };
    let assumed = assumed(options)?;
    let rows = recordings::open_assuming(&options.input, assumed.as_ref())?.filter(asked);
    let mut rows =
        rows.map(|row| row.map_err(|error| ExportError::Row(format!("cannot read {error}"))));
    export::write_recording(&mut rows, [&options.input, &options.output])?;
    Ok(Outcome::Done)
}

fn assumed(options: &Convert) -> Result<Option<Assumed>> {
    let Some(celsius) = options.thermistor else {
        return Ok(None);
    };
    let thermistor = word::thermistor_word(Celsius::new(celsius)).map_err(|range| {
        bad_input(anyhow!(
            "--thermistor {celsius}: expected {} to {} °C",
            range.lowest,
            range.highest
        ))
    })?;
    Ok(Some(Assumed {
        stream: StreamId {
            device: "imported".to_owned(),
            sensor: "grid-eye".to_owned(),
            // Only characters that a boot's name may have.
            boot: linaige::stream_from_file_name(&files::stem(&options.input)).boot,
        },
        thermistor: Some(thermistor),
        period: Duration::try_from_secs_f64(1.0 / options.rate)
            .map_err(|error| bad_input(anyhow!("--rate {}: {error}", options.rate)))?,
    }))
}
