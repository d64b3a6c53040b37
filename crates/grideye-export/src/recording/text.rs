//! CSV: this project's recording format if the sensor has 8 x 8 pixels, otherwise a table of degrees.

use super::rows::{Out, Rows};
use crate::error::ExportError;
use grideye_recording::csv::Writer;
use std::time::Duration;

pub(super) fn write(rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    if !rows.are_of_a_grid_eye() {
        return table(rows, out);
    }
    let mut writer = Writer::with_labels(out, rows.labels)?;
    for row in rows {
        writer.write(&row?.try_into()?)?;
    }
    let written = writer.rows();
    writer.finish()?;
    Ok(format!("{written} rows"))
}

/// One row per frame: its number, its time, and each pixel in °C, row by row from the top left.
fn table(rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    let (columns, pixel_rows) = rows.size;
    let pixels = (0..pixel_rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    let names = pixels.map(|(row, column)| format!(",r{row}c{column}_c"));
    writeln!(out, "seq,time_s{}", names.collect::<String>())?;
    let mut written: u64 = 0;
    for row in rows {
        let row = row?;
        let time = Duration::from_nanos(row.stamp.t_boot_ns).as_secs_f64();
        let pixels = row.pixels_c.iter().flatten();
        let cells: String = pixels.map(|celsius| format!(",{celsius:.3}")).collect();
        writeln!(out, "{},{time:.6}{cells}", row.seq)?;
        written += 1;
    }
    Ok(format!("a table of {written} rows"))
}
