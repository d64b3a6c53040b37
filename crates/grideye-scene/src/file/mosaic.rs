//! Adjacent cuboids, one for each number (PeerJ CS 11:e3124, "Experiment 5").

use crate::file::clothes;
use crate::file::keys::rgb;
use crate::file::reader::{Read, Reader, columns, meters, name};
use crate::geometry::{Cuboid, Mesh, count::float};
use crate::heat::Thermal;
use crate::model::{Body, limits};
use crate::radiometry::Surface;
use glam::DVec3;
use grideye_text::Table;

/// The cells, from back to front and from left to right, as on a map.
pub(crate) fn cells(
    reader: &Reader<'_>,
    table: &Table<'_>,
    objects_before: usize,
) -> Read<Vec<Body>> {
    let Some(temperatures_c) = table.get("temperatures_c") else {
        return Ok(Vec::new());
    };
    let expected = "rows of numbers, each as long as the first";
    let columns = columns(temperatures_c, expected)?;
    let rows = temperatures_c.each().count();
    let found = objects_before.saturating_add(rows.saturating_mul(columns));
    let hint = "make the cells larger, or their number smaller";
    let limit = (limits::OBJECTS_MAX, temperatures_c.span().start);
    table.source.check_count("objects", found, limit, hint)?;
    let middle_m = meters(table, "position_mm").unwrap_or_default();
    let size_m = meters(table, "size_mm").unwrap_or_default();
    let emissivity = clothes::emissivity(reader, table)?;
    let half = |cells: usize| 0.5 * (float(cells) - 1.0);
    let mut cells = Vec::with_capacity(rows * columns);
    for (row, temperatures_c) in temperatures_c.each().enumerate() {
        for (column, celsius) in temperatures_c.each().enumerate() {
            let across = float(column) - half(columns);
            let back = half(rows) - float(row);
            let base_m = middle_m + DVec3::new(across * size_m.x, back * size_m.y, 0.0);
            let celsius = celsius.number().unwrap_or_default();
            cells.push(Body {
                name: format!("{} {} {}", name(table), row + 1, column + 1),
                base_m,
                mesh: Mesh::of_cuboid(&Cuboid::new(base_m, size_m, 0.0)),
                surface: Surface {
                    celsius,
                    emissivity,
                },
                color: table.text("color").and_then(rgb),
                thermal: Thermal::default(),
            });
        }
    }
    Ok(cells)
}
