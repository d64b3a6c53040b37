//! Cuboids side by side, one for each number: how the paper builds what has many temperatures (PeerJ CS 11:e3124,
//! "Experiment 5": each pixel of a picture is a separate object, in close proximity to others).

use crate::file::document::MosaicTable;
use crate::file::rule::TEMPERATURE;
use crate::file::source::Source;
use crate::file::{body, clothes};
use crate::geometry::count::float;
use crate::geometry::cuboid::Cuboid;
use crate::geometry::mesh::Mesh;
use crate::heat::thermal::Thermal;
use crate::model::body::Body;
use crate::model::error::SceneError;
use crate::model::limits;
use crate::radiometry::perceived::Surface;
use crate::text::refusal::Rule;
use glam::DVec3;
use toml::Spanned;

/// The cells, from the back to the front and from left to right, as a map has them.
pub(crate) fn cells(
    source: &Source<'_>,
    table: &Spanned<MosaicTable>,
    objects_before: usize,
) -> Result<Vec<Body>, SceneError> {
    let keys = table.get_ref();
    let name = source.name(&keys.name)?;
    let rows = rows(source, keys)?;
    let columns = rows.first().map_or(0, |row| row.len());
    let found = objects_before.saturating_add(rows.len().saturating_mul(columns));
    let hint = "make the cells larger, or their number smaller";
    let byte = keys.temperatures_c.span().start;
    source.check_count("objects", found, limits::OBJECTS_MAX, byte, hint)?;
    let middle_m = source.position_m(&keys.position_mm)?;
    let size_m = source.size_m(&keys.size_mm)?;
    let emissivity = clothes::emissivity(source, keys.emissivity.as_ref())?;
    let color = body::color(source, keys.color.as_ref())?;
    let half = |cells: usize| 0.5 * (float(cells) - 1.0);
    let mut cells = Vec::with_capacity(rows.len() * columns);
    for (row, temperatures_c) in rows.iter().enumerate() {
        for (column, celsius) in temperatures_c.iter().enumerate() {
            let across = float(column) - half(columns);
            let back = half(rows.len()) - float(row);
            let base_m = middle_m + DVec3::new(across * size_m.x, back * size_m.y, 0.0);
            cells.push(Body {
                name: format!("{name} {} {}", row + 1, column + 1),
                base_m,
                mesh: Mesh::of_cuboid(&Cuboid::new(base_m, size_m, 0.0)),
                surface: Surface {
                    celsius: source.number(celsius, &CELL)?,
                    emissivity,
                },
                color,
                thermal: Thermal::default(),
            });
        }
    }
    Ok(cells)
}

/// The numbers, one row as long as the other.
fn rows<'a>(
    source: &Source<'_>,
    keys: &'a MosaicTable,
) -> Result<Vec<&'a Vec<Spanned<f64>>>, SceneError> {
    let rows: Vec<_> = keys.temperatures_c.get_ref().iter().collect();
    let columns = rows.first().map_or(0, |row| row.get_ref().len());
    let odd = rows
        .iter()
        .find(|row| row.get_ref().len() != columns || columns == 0);
    match (rows.is_empty(), odd) {
        (false, None) => Ok(rows.into_iter().map(Spanned::get_ref).collect()),
        (_, odd) => Err(source.refused(
            "temperatures_c",
            odd.map_or(keys.temperatures_c.span(), |row| row.span()),
            "rows of numbers, each as long as the first",
            "one number for each cell, rows from the back to the front: [[23, 24], [25, 26]]",
        )),
    }
}

const CELL: Rule = Rule {
    key: "temperatures_c",
    ..TEMPERATURE
};
