//! Bodies with several temperatures (by face, gradient or grid of cells) and bodies that warm up or cool down.
//!
//! Faces are cut into parts of uniform temperature; a gradient into strips of [`STEP_C`], at most [`STRIPS_MAX`].

use crate::file::document::{ObjectTable, Rows};
use crate::file::reader::{Read, Reader, columns};
use crate::file::rule::{CAPACITY, GRADIENT, POWER, TEMPERATURE, TIME_CONSTANT};
use crate::geometry::{Mesh, clipped, count, range};
use crate::heat::{Material, Thermal, Transient};
use crate::model::limits;
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;
use toml::Spanned;

/// A body's place and rotation in the room, and its mean temperature.
pub(crate) struct Stand {
    pub(crate) base_m: DVec3,
    pub(crate) rotation: DMat3,
    pub(crate) celsius: f64,
}

/// Largest difference between adjacent strips or cells of a gradient, °C, as far as the limits allow.
const STEP_C: f64 = 0.1;
const STRIPS_MAX: usize = 256;
const PARTS_MAX: usize = 100;

/// A body's surface, cut where temperatures change, and its warmth.
pub(crate) fn of(
    reader: &Reader<'_>,
    table: &Spanned<ObjectTable>,
    mesh: Mesh,
    stand: &Stand,
) -> Read<(Mesh, Thermal)> {
    check_keys(reader, table)?;
    let keys = table.get_ref();
    let (mesh, offsets_c) = if let Some(faces_c) = &keys.faces_c {
        let offsets_c = by_face(reader, keys, faces_c, &mesh, stand.celsius)?;
        (mesh, offsets_c)
    } else if let Some(gradient) = &keys.gradient_c_per_m {
        let gradient = DVec3::from_array(reader.numbers(gradient, &GRADIENT)?);
        along(&mesh, stand.base_m, stand.rotation * gradient)
    } else if let Some(texture_c) = &keys.texture_c {
        texture(reader, (table, texture_c), &mesh, stand)?
    } else {
        (mesh, Vec::new())
    };
    let materials = [
        ("foam", Material::Foam),
        ("textile", Material::Textile),
        ("wood", Material::Wood),
    ];
    let hint = "an object with a material keeps a warm print of whoever stood, sat or lay on it";
    let thermal = Thermal {
        transient: heat(reader, table)?,
        material: reader.choice("material", &keys.material, &materials, hint)?,
        offsets_c,
    };
    Ok((mesh, thermal))
}

fn check_keys(reader: &Reader<'_>, table: &Spanned<ObjectTable>) -> Read<()> {
    let keys = table.get_ref();
    let title = || format!("`{}`", keys.name.get_ref());
    let spreads = [
        ("faces_c", keys.faces_c.is_some()),
        ("gradient_c_per_m", keys.gradient_c_per_m.is_some()),
        ("texture_c", keys.texture_c.is_some()),
    ];
    let mut given = spreads.iter().filter(|(_, given)| *given);
    if let (Some((key, _)), Some((other, _))) = (given.next(), given.next()) {
        let hint = "faces, gradient and texture are alternatives; give one of them";
        return Err(reader.conflict(table.span().start, &title(), [key, other], hint));
    }
    let texture = ("texture_c", keys.texture_c.is_some());
    let power = ("power_w", keys.power_w.is_some());
    let time = ("time_constant_s", keys.time_constant_s.is_some());
    let capacity = (
        "heat_capacity_j_per_k",
        keys.heat_capacity_j_per_k.is_some(),
    );
    let needs = [
        (keys.texture_on.is_some(), texture),
        (keys.texture_filter.is_some(), texture),
        (power.1, time),
        (power.1, capacity),
        (capacity.1, power),
        (keys.on_s.is_some(), power),
    ];
    match needs.iter().find(|(given, (_, needed))| *given && !needed) {
        None => Ok(()),
        Some((_, (key, _))) => {
            let hint = "texture_on and texture_filter go with texture_c; power_w with time_constant_s and heat_capacity_j_per_k; on_s with power_w";
            Err(reader.missing(table.span().start, &title(), key, hint))
        }
    }
}

/// The faces of a cuboid in the order of `Mesh::of_cuboid`.
const CUBOID_FACES: [&str; 6] = ["left", "right", "front", "back", "bottom", "top"];

fn face_number(keys: &ObjectTable, name: &str) -> Option<usize> {
    let shape = keys.shape.as_ref();
    if shape.is_none_or(|shape| shape.get_ref() == "cuboid") {
        CUBOID_FACES.iter().position(|known| *known == name)
    } else {
        name.parse().ok()
    }
}

fn by_face(
    reader: &Reader<'_>,
    keys: &ObjectTable,
    faces_c: &Spanned<BTreeMap<String, Spanned<f64>>>,
    mesh: &Mesh,
    celsius: f64,
) -> Read<Vec<f64>> {
    let mut offsets_c = vec![0.0; mesh.faces().count()];
    for (name, face_c) in faces_c.get_ref() {
        let face_c = reader.number(face_c, &TEMPERATURE)?;
        let number = face_number(keys, name);
        let mut is_there = false;
        for (offset_c, given) in offsets_c.iter_mut().zip(mesh.given()) {
            if Some(*given) == number {
                *offset_c = face_c - celsius;
                is_there = true;
            }
        }
        if !is_there {
            let expected = "left, right, front, back, bottom, top of a cuboid, or a face's number from 0 of another shape";
            let hint = "as in faces_c = { top = 31.5 }; front is the side of low y before rotation";
            return Err(reader
                .refused("faces_c", faces_c.span(), expected, hint)
                .into());
        }
    }
    Ok(offsets_c)
}

fn along(mesh: &Mesh, base_m: DVec3, gradient: DVec3) -> (Mesh, Vec<f64>) {
    let offset_c = |point: DVec3| gradient.dot(point - base_m);
    let (low_c, high_c) = range(mesh.vertices_m().iter().map(|point| offset_c(*point)));
    let strips = count::floor(((high_c - low_c) / STEP_C).ceil()).clamp(1, STRIPS_MAX);
    let step_c = (high_c - low_c) / count::float(strips);
    mesh.cut(|_, corners| {
        let (from_c, to_c) = range(corners.iter().map(|point| offset_c(*point)));
        let strip = |celsius: f64| match step_c > 0.0 {
            true => count::floor((celsius - low_c) / step_c).min(strips - 1),
            false => 0,
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

fn texture(
    reader: &Reader<'_>,
    (table, grid): (&Spanned<ObjectTable>, &Spanned<Rows>),
    mesh: &Mesh,
    stand: &Stand,
) -> Read<(Mesh, Vec<f64>)> {
    let keys = table.get_ref();
    let cells = Cells::of(reader, keys, grid)?;
    let on = keys.texture_on.as_ref().map_or("all", |on| on.get_ref());
    let number = face_number(keys, on);
    if on != "all" && !(CUBOID_FACES.contains(&on) && number.is_some()) {
        let expected = "\"all\", or of a cuboid \"left\", \"right\", \"front\", \"back\", \"bottom\" or \"top\"";
        let hint = "\"all\" is the default: the grid is laid over the body from above";
        let span = keys.texture_on.as_ref().map_or(table.span(), Spanned::span);
        return Err(reader.refused("texture_on", span, expected, hint).into());
    }
    // Right and up as seen from in front of the face; from above as on a map.
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
    Ok(mesh.cut(|face, corners| {
        if on != "all" && Some(mesh.given()[face]) != number {
            return vec![(corners.to_vec(), 0.0)];
        }
        let parts = cells.over(corners, place).into_iter();
        parts
            .map(|(part, celsius)| (part, celsius - stand.celsius))
            .collect()
    }))
}

struct Cells {
    columns: usize,
    rows: usize,
    celsius: Vec<f64>,
}

impl Cells {
    fn of(reader: &Reader<'_>, keys: &ObjectTable, grid: &Spanned<Rows>) -> Read<Self> {
        let expected = "rows of the same number of temperatures, at least one of at least one";
        let hint = "the first row is at the top, or at the back if the face is level";
        let columns = columns(reader, "texture_c", grid, [expected, hint])?;
        let rows = grid.get_ref();
        let (found, limit) = (columns * rows.len(), limits::TEXTURE_CELLS_MAX);
        let hint = "a sensor of 80 x 60 pixels cannot resolve finer cells";
        reader.check_count("cells of a texture", found, limit, grid.span().start, hint)?;
        let cells = rows.iter().flat_map(Spanned::get_ref);
        let celsius = cells.map(|cell| reader.number(cell, &TEMPERATURE));
        let cells = Self {
            columns,
            rows: rows.len(),
            celsius: celsius.collect::<Result<_, _>>()?,
        };
        let filters = [("nearest", false), ("bilinear", true)];
        let hint = "nearest is the default: each cell has one temperature";
        let filter = reader.choice("texture_filter", &keys.texture_filter, &filters, hint)?;
        Ok(if filter == Some(true) {
            cells.interpolated()
        } else {
            cells
        })
    }

    fn at(&self, row: usize, column: usize) -> f64 {
        self.celsius[row * self.columns + column]
    }

    /// Divides the cells so that neighbors differ by at most [`STEP_C`], as far as the limits allow.
    fn interpolated(&self) -> Self {
        let mut largest_c: f64 = 0.0;
        for row in 0..self.rows {
            for column in 0..self.columns {
                let below = (row + 1).min(self.rows - 1);
                let right = (column + 1).min(self.columns - 1);
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

    /// Bilinear between the centers of the cells, constant beyond the outermost.
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

    /// The parts of a face in each cell, and their temperatures; `place` maps a point to the grid.
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

fn heat(reader: &Reader<'_>, table: &Spanned<ObjectTable>) -> Read<Option<Transient>> {
    let keys = table.get_ref();
    let Some(time_constant) = &keys.time_constant_s else {
        return Ok(None);
    };
    let time_constant_s = reader.number(time_constant, &TIME_CONSTANT)?;
    let power_w = reader.number_or(&keys.power_w, &POWER, 0.0)?;
    let capacity = reader.number_or(&keys.heat_capacity_j_per_k, &CAPACITY, 1.0)?;
    let always = vec![[0.0, f64::INFINITY]];
    let on_s = keys.on_s.as_ref().map_or(always, |on| {
        on.get_ref().iter().map(|interval| interval.0).collect()
    });
    let starts_late = on_s.first().is_none_or(|first| first[0] >= 0.0);
    if !starts_late || !on_s.as_flattened().is_sorted_by(|one, other| one < other) {
        let expected = "[[from, until], …] in seconds from 0 on, one after the other";
        let hint = "as in on_s = [[60, 600], [900, 1200]]";
        let span = keys.on_s.as_ref().map_or(table.span(), Spanned::span);
        return Err(reader.refused("on_s", span, expected, hint).into());
    }
    Ok(Some(Transient {
        time_constant_s,
        rise_c: power_w * time_constant_s / capacity,
        on_s,
    }))
}
