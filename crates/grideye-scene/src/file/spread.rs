//! Bodies that are not of one temperature: faces of their own temperatures, a gradient, a grid of cells; and bodies
//! that warm up or cool down.
//!
//! Faces are cut into parts of one temperature each, so that everything that draws faces draws these as well. A
//! gradient is cut into strips of [`STEP_C`], or into [`STRIPS_MAX`]: nowhere is it off by more than half a strip.

use crate::file::document::ObjectTable;
use crate::file::rule::{CAPACITY, GRADIENT, POWER, TEMPERATURE, TIME_CONSTANT};
use crate::file::source::Source;
use crate::geometry::angle::rotation_z_deg;
use crate::geometry::count;
use crate::geometry::mesh::Mesh;
use crate::geometry::polygon::clipped;
use crate::heat::thermal::Thermal;
use crate::heat::transient::{Material, Transient};
use crate::model::error::SceneError;
use crate::model::limits;
use glam::{DMat3, DVec3};
use toml::Spanned;

/// How a body stands in the room, and how warm it is on the whole.
pub(crate) struct Stand {
    pub(crate) base_m: DVec3,
    /// From its own axes to the room's.
    pub(crate) rotation: DMat3,
    pub(crate) celsius: f64,
}

impl Stand {
    pub(crate) fn new(base_m: DVec3, yaw_deg: f64, tilt: DMat3, celsius: f64) -> Self {
        Self {
            base_m,
            rotation: rotation_z_deg(yaw_deg) * tilt,
            celsius,
        }
    }
}

/// The most that two neighbouring strips or cells of a gradient differ, °C, so long as the limits allow it.
pub(crate) const STEP_C: f64 = 0.1;
/// Strips of a gradient.
pub(crate) const STRIPS_MAX: usize = 256;
/// Parts along each side of a cell that is interpolated.
const PARTS_MAX: usize = 100;

/// What the keys say of a body's warmth, and its surface, cut where temperatures meet.
pub(crate) fn of(
    source: &Source<'_>,
    table: &Spanned<ObjectTable>,
    mesh: Mesh,
    stand: &Stand,
) -> Result<(Mesh, Thermal), SceneError> {
    check_keys(source, table)?;
    let keys = table.get_ref();
    let (mesh, offsets_c) = if let Some(faces_c) = &keys.faces_c {
        let offsets_c = by_face(source, keys, faces_c, &mesh, stand.celsius)?;
        (mesh, offsets_c)
    } else if let Some(gradient) = &keys.gradient_c_per_m {
        for part in gradient.get_ref().0 {
            source.number(&Spanned::new(gradient.span(), part), &GRADIENT)?;
        }
        let gradient = stand.rotation * DVec3::from_array(gradient.get_ref().0);
        along(&mesh, stand.base_m, gradient)
    } else if keys.texture_c.is_some() {
        texture(source, table, &mesh, stand)?
    } else {
        (mesh, Vec::new())
    };
    let thermal = Thermal {
        transient: heat(source, table)?,
        material: material(source, keys)?,
        offsets_c,
    };
    Ok((mesh, thermal))
}

/// Keys that exclude one another, and keys that mean nothing alone.
fn check_keys(source: &Source<'_>, table: &Spanned<ObjectTable>) -> Result<(), SceneError> {
    let keys = table.get_ref();
    let spreads = [
        ("faces_c", keys.faces_c.is_some()),
        ("gradient_c_per_m", keys.gradient_c_per_m.is_some()),
        ("texture_c", keys.texture_c.is_some()),
    ];
    let mut given = spreads.iter().filter(|(_, given)| *given);
    if let (Some((key, _)), Some((other, _))) = (given.next(), given.next()) {
        return Err(SceneError::KeysConflict {
            place: source.place(table.span().start),
            table: format!("`{}`", keys.name.get_ref()),
            key,
            other,
            hint: "faces, gradient and texture each say how the temperature is spread; give one of them",
        });
    }
    let pairs = [
        (
            "texture_on",
            keys.texture_on.is_some(),
            "texture_c",
            keys.texture_c.is_some(),
        ),
        (
            "texture_filter",
            keys.texture_filter.is_some(),
            "texture_c",
            keys.texture_c.is_some(),
        ),
        (
            "power_w",
            keys.power_w.is_some(),
            "time_constant_s",
            keys.time_constant_s.is_some(),
        ),
        (
            "power_w",
            keys.power_w.is_some(),
            "heat_capacity_j_per_k",
            keys.heat_capacity_j_per_k.is_some(),
        ),
        (
            "heat_capacity_j_per_k",
            keys.heat_capacity_j_per_k.is_some(),
            "power_w",
            keys.power_w.is_some(),
        ),
        (
            "on_s",
            keys.on_s.is_some(),
            "power_w",
            keys.power_w.is_some(),
        ),
    ];
    match pairs.iter().find(|(_, given, _, needed)| *given && !needed) {
        None => Ok(()),
        Some((_, _, key, _)) => Err(SceneError::MissingKey {
            place: source.place(table.span().start),
            table: format!("`{}`", keys.name.get_ref()),
            key,
            hint: "texture_on and texture_filter go with texture_c; power_w with time_constant_s and heat_capacity_j_per_k; on_s with power_w",
        }),
    }
}

/// The faces of a cuboid in the order of `Mesh::of_cuboid`.
const CUBOID_FACES: [&str; 6] = ["left", "right", "front", "back", "bottom", "top"];

fn face_number(keys: &ObjectTable, name: &str) -> Option<usize> {
    let is_cuboid = keys
        .shape
        .as_ref()
        .is_none_or(|shape| shape.get_ref() == "cuboid");
    if is_cuboid {
        CUBOID_FACES.iter().position(|known| *known == name)
    } else {
        name.parse().ok()
    }
}

fn by_face(
    source: &Source<'_>,
    keys: &ObjectTable,
    faces_c: &Spanned<std::collections::BTreeMap<String, Spanned<f64>>>,
    mesh: &Mesh,
    celsius: f64,
) -> Result<Vec<f64>, SceneError> {
    let mut offsets_c = vec![0.0; mesh.faces().count()];
    for (name, face_c) in faces_c.get_ref() {
        let face_c_checked = source.number(face_c, &TEMPERATURE)?;
        let number = face_number(keys, name);
        let mut is_there = false;
        for (offset_c, given) in offsets_c.iter_mut().zip(mesh.given()) {
            if Some(*given) == number {
                *offset_c = face_c_checked - celsius;
                is_there = true;
            }
        }
        if !is_there {
            return Err(source.refused(
                "faces_c",
                faces_c.span(),
                "left, right, front, back, bottom, top of a cuboid, or a face's number from 0 of another shape",
                "as in faces_c = { top = 31.5 }; front is the side of low y before the body is turned",
            ));
        }
    }
    Ok(offsets_c)
}

/// Cuts a body into strips across a gradient, °C a metre in the room.
fn along(mesh: &Mesh, base_m: DVec3, gradient: DVec3) -> (Mesh, Vec<f64>) {
    let offset_c = |point: DVec3| gradient.dot(point - base_m);
    let (low_c, high_c) = range(mesh.vertices_m().iter().map(|point| offset_c(*point)));
    let strips = count::floor(((high_c - low_c) / STEP_C).ceil()).clamp(1, STRIPS_MAX);
    let step_c = (high_c - low_c) / count::float(strips);
    mesh.cut(|_, corners| {
        let (from_c, to_c) = range(corners.iter().map(|point| offset_c(*point)));
        let strip = |celsius: f64| {
            let index = if step_c > 0.0 {
                (celsius - low_c) / step_c
            } else {
                0.0
            };
            count::floor(index).min(strips - 1)
        };
        (strip(from_c)..=strip(to_c))
            .map(|index| {
                let start_c = low_c + step_c * count::float(index);
                let part = clipped(corners, |point| offset_c(point) - start_c);
                let part = clipped(&part, |point| start_c + step_c - offset_c(point));
                (part, start_c + 0.5 * step_c)
            })
            .collect()
    })
}

/// A grid of temperatures on one face, or on all as seen from above.
fn texture(
    source: &Source<'_>,
    table: &Spanned<ObjectTable>,
    mesh: &Mesh,
    stand: &Stand,
) -> Result<(Mesh, Vec<f64>), SceneError> {
    let keys = table.get_ref();
    let cells = Cells::of(source, keys)?;
    let on = keys.texture_on.as_ref().map_or("all", |on| on.get_ref());
    let number = face_number(keys, on);
    let known = on == "all" || CUBOID_FACES.contains(&on) && number.is_some();
    if !known {
        return Err(source.refused(
            "texture_on",
            keys.texture_on.as_ref().map_or(table.span(), Spanned::span),
            "\"all\", or of a cuboid \"left\", \"right\", \"front\", \"back\", \"bottom\" or \"top\"",
            "\"all\" is the default: the grid is laid over the body from above",
        ));
    }
    // Right and up as somebody sees the face who stands before it; from above as on a map.
    let (right, up) = match on {
        "left" => (DVec3::NEG_Y, DVec3::Z),
        "right" => (DVec3::Y, DVec3::Z),
        "front" => (DVec3::X, DVec3::Z),
        "back" => (DVec3::NEG_X, DVec3::Z),
        "bottom" => (DVec3::NEG_X, DVec3::Y),
        _ => (DVec3::X, DVec3::Y),
    };
    let (right, up) = (stand.rotation * right, stand.rotation * up);
    let across = range(mesh.vertices_m().iter().map(|point| right.dot(*point)));
    let upward = range(mesh.vertices_m().iter().map(|point| up.dot(*point)));
    let place = |point: DVec3| {
        let column = (right.dot(point) - across.0) / (across.1 - across.0);
        let row = (upward.1 - up.dot(point)) / (upward.1 - upward.0);
        [
            column * count::float(cells.columns),
            row * count::float(cells.rows),
        ]
    };
    let given = mesh.given().to_vec();
    Ok(mesh.cut(|face, corners| {
        if on != "all" && Some(given[face]) != number {
            return vec![(corners.to_vec(), 0.0)];
        }
        cells
            .over(corners, place)
            .into_iter()
            .map(|(part, celsius)| (part, celsius - stand.celsius))
            .collect()
    }))
}

/// Cells of one temperature each, row by row from the top.
struct Cells {
    columns: usize,
    rows: usize,
    celsius: Vec<f64>,
}

impl Cells {
    fn of(source: &Source<'_>, keys: &ObjectTable) -> Result<Self, SceneError> {
        let Some(grid) = &keys.texture_c else {
            return Ok(Self {
                columns: 0,
                rows: 0,
                celsius: Vec::new(),
            });
        };
        let rows = grid.get_ref();
        let columns = rows.first().map_or(0, |row| row.get_ref().len());
        let uneven = rows.iter().find(|row| row.get_ref().len() != columns);
        if columns == 0 || uneven.is_some() {
            return Err(source.refused(
                "texture_c",
                uneven.map_or(grid.span(), Spanned::span),
                "rows of the same number of temperatures, at least one of at least one",
                "the first row is at the top, or of what lies, at the back",
            ));
        }
        source.check_count(
            "cells of a texture",
            columns * rows.len(),
            limits::TEXTURE_CELLS_MAX,
            grid.span().start,
            "a sensor of 80 x 60 pixels cannot tell finer cells apart",
        )?;
        let mut celsius = Vec::with_capacity(columns * rows.len());
        for row in rows {
            for cell in row.get_ref() {
                celsius.push(source.number(cell, &TEMPERATURE)?);
            }
        }
        let cells = Self {
            columns,
            rows: rows.len(),
            celsius,
        };
        match keys
            .texture_filter
            .as_ref()
            .map(|filter| (filter, filter.get_ref().as_str()))
        {
            None | Some((_, "nearest")) => Ok(cells),
            Some((_, "bilinear")) => Ok(cells.interpolated()),
            Some((filter, _)) => Err(source.refused(
                "texture_filter",
                filter.span(),
                "\"nearest\" or \"bilinear\"",
                "nearest is the default: each cell has one temperature",
            )),
        }
    }

    fn at(&self, row: usize, column: usize) -> f64 {
        self.celsius[row * self.columns + column]
    }

    /// As many cells as make neighbours differ by no more than [`STEP_C`], so far as the limits allow.
    fn interpolated(&self) -> Self {
        let mut largest_c: f64 = 0.0;
        for row in 0..self.rows {
            for column in 0..self.columns {
                let (below, right) = (
                    (row + 1).min(self.rows - 1),
                    (column + 1).min(self.columns - 1),
                );
                let here = self.at(row, column);
                largest_c = largest_c
                    .max((self.at(below, column) - here).abs())
                    .max((self.at(row, right) - here).abs());
            }
        }
        let mut parts = count::floor((largest_c / STEP_C).ceil()).clamp(1, PARTS_MAX);
        while parts > 1 && parts * parts * self.celsius.len() > limits::TEXTURE_CELLS_MAX {
            parts -= 1;
        }
        let (columns, rows) = (parts * self.columns, parts * self.rows);
        let middle = |index: usize| (count::float(index) + 0.5) / count::float(parts);
        let celsius = (0..rows * columns)
            .map(|index| self.between(middle(index / columns), middle(index % columns)))
            .collect();
        Self {
            columns,
            rows,
            celsius,
        }
    }

    /// Bilinear between the middles of the cells, constant beyond the outermost.
    fn between(&self, row: f64, column: f64) -> f64 {
        let split = |at: f64, count: usize| {
            let at = (at - 0.5).clamp(0.0, count::float(count - 1));
            let first = count::floor(at).min(count - 1);
            (first, (first + 1).min(count - 1), at - count::float(first))
        };
        let (top, bottom, down) = split(row, self.rows);
        let (left, right, along) = split(column, self.columns);
        let mix = |one: f64, other: f64, share: f64| one + (other - one) * share;
        mix(
            mix(self.at(top, left), self.at(top, right), along),
            mix(self.at(bottom, left), self.at(bottom, right), along),
            down,
        )
    }

    /// The parts of a face in the cells, and the temperature of each; `place` says where on the grid a point lies.
    fn over(&self, corners: &[DVec3], place: impl Fn(DVec3) -> [f64; 2]) -> Vec<(Vec<DVec3>, f64)> {
        let reach = |axis: usize, count: usize| {
            let (low, high) = range(corners.iter().map(|point| place(*point)[axis]));
            count::floor(low).min(count - 1)..=count::floor(high).min(count - 1)
        };
        let mut parts = Vec::new();
        for row in reach(1, self.rows) {
            let top = count::float(row);
            let strip = clipped(corners, |point| place(point)[1] - top);
            let strip = clipped(&strip, |point| top + 1.0 - place(point)[1]);
            for column in reach(0, self.columns) {
                let left = count::float(column);
                let part = clipped(&strip, |point| place(point)[0] - left);
                let part = clipped(&part, |point| left + 1.0 - place(point)[0]);
                parts.push((part, self.at(row, column)));
            }
        }
        parts
    }
}

fn heat(
    source: &Source<'_>,
    table: &Spanned<ObjectTable>,
) -> Result<Option<Transient>, SceneError> {
    let keys = table.get_ref();
    let Some(time_constant) = &keys.time_constant_s else {
        return Ok(None);
    };
    let time_constant_s = source.number(time_constant, &TIME_CONSTANT)?;
    let power_w = source.number_or(keys.power_w.as_ref(), &POWER, 0.0)?;
    let capacity = source.number_or(keys.heat_capacity_j_per_k.as_ref(), &CAPACITY, 1.0)?;
    let always = vec![[0.0, f64::INFINITY]];
    let on_s = keys.on_s.as_ref().map_or(always, |on| {
        on.get_ref().iter().map(|interval| interval.0).collect()
    });
    let ends = on_s.iter().flatten();
    let rises = ends
        .clone()
        .zip(ends.skip(1))
        .all(|(one, other)| one < other);
    let starts_late = on_s.first().is_none_or(|first| first[0] >= 0.0);
    if !rises || !starts_late {
        return Err(source.refused(
            "on_s",
            keys.on_s.as_ref().map_or(table.span(), Spanned::span),
            "[[from, until], …] in seconds from 0 on, one after the other",
            "as in on_s = [[60, 600], [900, 1200]]",
        ));
    }
    let rise_c = power_w * time_constant_s / capacity;
    Ok(Some(Transient {
        time_constant_s,
        rise_c,
        on_s,
    }))
}

fn material(source: &Source<'_>, keys: &ObjectTable) -> Result<Option<Material>, SceneError> {
    let Some(material) = &keys.material else {
        return Ok(None);
    };
    match material.get_ref().as_str() {
        "foam" => Ok(Some(Material::Foam)),
        "textile" => Ok(Some(Material::Textile)),
        "wood" => Ok(Some(Material::Wood)),
        _ => Err(source.refused(
            "material",
            material.span(),
            "\"foam\", \"textile\" or \"wood\"",
            "an object of a material keeps a warm print of who stood, sat or lay on it",
        )),
    }
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    })
}
