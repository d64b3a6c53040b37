//! Apache Parquet with the columns of the recording format, same names and order:
//!
//! | column | type |
//! |---|---|
//! | `device`, `sensor`, `boot`, `clock` | string |
//! | `seq`, `t_boot_ns` | unsigned 64-bit |
//! | `t_utc_ns`, `t_arrival_ns` | signed 64-bit, nanoseconds since 1970-01-01 UTC; the latter may be null |
//! | `missing` | string, null if there is a frame |
//! | `thermistor`, `pixel1` to `pixel64` | double, °C, null without a frame or thermistor |
//! | the labels, as `label_…` where a column has their name | string |

use super::rows::{Out, Rows};
use crate::error::ExportError;
use crate::parquet::{Column, Table, Values};
use amg8833::word;
use grideye_frame::{Celsius, PIXELS, Reading, RecordedFrame};
use grideye_recording::Row;

/// Rows in memory at once.
const GROUP_ROWS: usize = 20_000;

pub(super) fn write(rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    let about = [(
        "program",
        concat!("grideye ", env!("CARGO_PKG_VERSION")).to_owned(),
    )];
    let labels = rows.labels;
    let mut table = Table::new(&columns(&[], labels), &about, out)?;
    let mut group = Vec::new();
    let mut written = 0;
    for row in rows {
        group.push(row?);
        written += 1;
        if group.len() == GROUP_ROWS {
            table.add(&columns(&group, labels))?;
            group.clear();
        }
    }
    if !group.is_empty() {
        table.add(&columns(&group, labels))?;
    }
    table.finish()?;
    Ok(format!("{written} rows"))
}

fn columns(rows: &[Row], labels: &[String]) -> Vec<Column> {
    let text =
        |of: fn(&Row) -> &str| Values::Text(rows.iter().map(|row| of(row).to_owned()).collect());
    let unsigned = |of: fn(&Row) -> u64| Values::Unsigned(rows.iter().map(of).collect());
    let signed = |of: fn(&Row) -> Option<i64>| Values::Signed(rows.iter().map(of).collect());
    let celsius = |of: &dyn Fn(&RecordedFrame) -> Option<Celsius>| {
        let value = |row: &Row| {
            let celsius = row.record.reading.frame().and_then(of);
            celsius.map(|celsius| f64::from(celsius.get()))
        };
        Values::Double(rows.iter().map(value).collect())
    };
    let missing = |row: &Row| match &row.record.reading {
        Reading::Frame(_) => None,
        Reading::NoData(reason) => Some(reason.name().to_owned()),
    };
    let mut columns = vec![
        Column::new("device", text(|row| &row.stream.device)),
        Column::new("sensor", text(|row| &row.stream.sensor)),
        Column::new("boot", text(|row| &row.stream.boot)),
        Column::new("seq", unsigned(|row| row.record.seq)),
        Column::new("t_boot_ns", unsigned(|row| row.record.stamp.t_boot_ns)),
        Column::new("t_utc_ns", signed(|row| Some(row.record.stamp.t_utc_ns))),
        Column::new("clock", text(|row| row.record.stamp.clock.name())),
        Column::new("t_arrival_ns", signed(|row| row.t_arrival_ns)),
        Column::new(
            "missing",
            Values::MaybeText(rows.iter().map(missing).collect()),
        ),
        Column::new(
            "thermistor",
            celsius(&|frame| frame.thermistor.map(word::thermistor_celsius)),
        ),
    ];
    columns.extend((0..PIXELS).map(|index| {
        let values = celsius(&|frame| Some(word::pixel_celsius(frame.pixels[index])));
        Column::new(format!("pixel{}", index + 1), values)
    }));
    for (index, label) in labels.iter().enumerate() {
        let value = |row: &Row| {
            row.labels
                .get(index)
                .filter(|text| !text.is_empty())
                .cloned()
        };
        let values = Values::MaybeText(rows.iter().map(value).collect());
        let is_taken = columns.iter().any(|column| column.name() == label);
        let prefix = if is_taken { "label_" } else { "" };
        columns.push(Column::new(format!("{prefix}{label}"), values));
    }
    columns
}
