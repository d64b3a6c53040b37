//! Apache Parquet with the columns of the recording format, same names and order:
//!
//! | column | type |
//! |---|---|
//! | `device`, `sensor`, `boot`, `clock` | string |
//! | `seq`, `t_boot_ns` | unsigned 64-bit |
//! | `t_utc_ns`, `t_arrival_ns` | signed 64-bit, nanoseconds since 1970-01-01 UTC; the latter may be null |
//! | `missing` | string, null if there is a frame |
//! | `thermistor`, `pixel1` to `pixel64` | double, °C, null without a frame or thermistor |
//! | `celsius` in place of pixels | list of float, °C, if the sensor has other than 8 x 8 pixels |
//! | the labels, as `label_…` where a column has their name | string |

use super::rows::{Out, Row, Rows};
use crate::error::ExportError;
use crate::parquet::{Column, Table, Values};
use grideye_frame::PIXELS;

/// Pixels in memory at once, of rows in a group.
const GROUP_PIXELS: usize = 20_000 * PIXELS;

pub(super) fn write(rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    let program = concat!("grideye ", env!("CARGO_PKG_VERSION")).to_owned();
    let mut about = vec![("program", program)];
    about.extend(
        rows.about
            .clone()
            .map(|about| ("grideye.simulation", about)),
    );
    let (labels, pixels) = (rows.labels, rows.size.0 * rows.size.1);
    let per_pixel = rows.are_of_a_grid_eye();
    let columns = |rows: &[Row]| columns(rows, (pixels, per_pixel), labels);
    let mut table = Table::new(&columns(&[]), &about, out)?;
    let mut group = Vec::new();
    let mut written = 0;
    for row in rows {
        group.push(row?);
        written += 1;
        if group.len() * pixels >= GROUP_PIXELS {
            table.add(&columns(&group))?;
            group.clear();
        }
    }
    if !group.is_empty() {
        table.add(&columns(&group))?;
    }
    table.finish()?;
    Ok(format!("{written} rows"))
}

fn columns(rows: &[Row], (pixels, per_pixel): (usize, bool), labels: &[String]) -> Vec<Column> {
    let text =
        |of: fn(&Row) -> &str| Values::Text(rows.iter().map(|row| of(row).to_owned()).collect());
    let unsigned = |of: fn(&Row) -> u64| Values::Unsigned(rows.iter().map(of).collect());
    let signed = |of: fn(&Row) -> Option<i64>| Values::Signed(rows.iter().map(of).collect());
    let celsius = |of: &dyn Fn(&Row) -> Option<f32>| {
        Values::Double(rows.iter().map(|row| of(row).map(f64::from)).collect())
    };
    let missing = rows.iter().map(|row| row.missing().map(str::to_owned));
    let mut columns = vec![
        Column::new("device", text(|row| &row.stream.device)),
        Column::new("sensor", text(|row| &row.stream.sensor)),
        Column::new("boot", text(|row| &row.stream.boot)),
        Column::new("seq", unsigned(|row| row.seq)),
        Column::new("t_boot_ns", unsigned(|row| row.stamp.t_boot_ns)),
        Column::new("t_utc_ns", signed(|row| Some(row.stamp.t_utc_ns))),
        Column::new("clock", text(|row| row.stamp.clock.name())),
        Column::new("t_arrival_ns", signed(|row| row.t_arrival_ns)),
        Column::new("missing", Values::MaybeText(missing.collect())),
        Column::new("thermistor", celsius(&|row| row.thermistor_c)),
    ];
    let pixel = |row: &Row, pixel: usize| row.pixels_c.as_ref().ok()?.get(pixel).copied();
    if per_pixel {
        columns.extend((0..pixels).map(|index| {
            let values = celsius(&|row| pixel(row, index));
            Column::new(format!("pixel{}", index + 1), values)
        }));
    } else {
        let all = rows
            .iter()
            .flat_map(|row| (0..pixels).map(move |index| pixel(row, index).unwrap_or(f32::NAN)));
        let values = all.collect();
        let axes = vec![pixels];
        columns.push(Column::new("celsius", Values::Singles { axes, values }));
    }
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
