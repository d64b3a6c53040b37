//! Adjacent cuboids, one for each number (PeerJ CS 11:e3124, "Experiment 5").

use crate::file::document::MosaicTable;
use crate::file::reader::{Read, Reader, columns};
use crate::file::rule::TEMPERATURE;
use crate::file::{body, clothes};
use crate::geometry::{Cuboid, Mesh, count::float};
use crate::heat::Thermal;
use crate::model::{Body, limits};
use crate::radiometry::Surface;
use crate::text::Rule;
use glam::DVec3;

/// The cells, from back to front and from left to right, as on a map.
pub(crate) fn cells(
    reader: &Reader<'_>,
    keys: &MosaicTable,
    objects_before: usize,
) -> Read<Vec<Body>> {
    let name = reader.name(&keys.name)?;
    let expected = "rows of numbers, each as long as the first";
    let hint = "one number for each cell, rows from the back to the front: [[23, 24], [25, 26]]";
    let columns = columns(
        reader,
        "temperatures_c",
        &keys.temperatures_c,
        [expected, hint],
    )?;
    let rows = keys.temperatures_c.get_ref();
    let found = objects_before.saturating_add(rows.len().saturating_mul(columns));
    let hint = "make the cells larger, or their number smaller";
    let byte = keys.temperatures_c.span().start;
    reader.check_count("objects", found, limits::OBJECTS_MAX, byte, hint)?;
    let middle_m = reader.position_m(&keys.position_mm)?;
    let size_m = reader.size_m(&keys.size_mm)?;
    let emissivity = clothes::emissivity(reader, &keys.emissivity)?;
    let color = body::color(reader, &keys.color)?;
    let half = |cells: usize| 0.5 * (float(cells) - 1.0);
    let mut cells = Vec::with_capacity(rows.len() * columns);
    for (row, temperatures_c) in rows.iter().enumerate() {
        for (column, celsius) in temperatures_c.get_ref().iter().enumerate() {
            let across = float(column) - half(columns);
            let back = half(rows.len()) - float(row);
            let base_m = middle_m + DVec3::new(across * size_m.x, back * size_m.y, 0.0);
            let celsius = reader.number(celsius, &CELL)?;
            cells.push(Body {
                name: format!("{name} {} {}", row + 1, column + 1),
                base_m,
                mesh: Mesh::of_cuboid(&Cuboid::new(base_m, size_m, 0.0)),
                surface: Surface {
                    celsius,
                    emissivity,
                },
                color,
                thermal: Thermal::default(),
            });
        }
    }
    Ok(cells)
}

const CELL: Rule = TEMPERATURE.of("temperatures_c");
