//! Bodies with several temperatures (by face, gradient or grid of cells) and bodies that warm up or cool down.
//!
//! Faces are cut into parts of uniform temperature; a gradient into strips of [`STEP_C`], at most [`STRIPS_MAX`].

use crate::file::reader::{Read, columns};
use crate::geometry::{Mesh, clipped, count, range};
use crate::heat::{Material, Thermal, Transient};
use crate::model::limits;
use glam::{DMat3, DVec3};
use grideye_text::{Table, Value};

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
pub(crate) fn of(table: &Table<'_>, mesh: Mesh, stand: &Stand) -> Read<(Mesh, Thermal)> {
    let (mesh, offsets_c) = if let Some(faces_c) = table.get("faces_c") {
        let offsets_c = by_face(table, faces_c, &mesh, stand.celsius)?;
        (mesh, offsets_c)
    } else if let Some(gradient) = table.list("gradient_c_per_m") {
        let gradient = stand.rotation * DVec3::from_array(gradient);
        along(&mesh, stand.base_m, gradient)
    } else if let Some(texture_c) = table.get("texture_c") {
        texture(table, texture_c, &mesh, stand)?
    } else {
        (mesh, Vec::new())
    };
    let thermal = Thermal {
        transient: heat(table)?,
        material: table.text("material").map(|material| match material {
            "foam" => Material::Foam,
            "textile" => Material::Textile,
            _ => Material::Wood,
        }),
        offsets_c,
    };
    Ok((mesh, thermal))
}

/// The faces of a cuboid in the order of `Mesh::of_cuboid`.
const CUBOID_FACES: [&str; 6] = ["left", "right", "front", "back", "bottom", "top"];

fn face_number(table: &Table<'_>, name: &str) -> Option<usize> {
    if table.text("shape").is_none_or(|shape| shape == "cuboid") {
        CUBOID_FACES.iter().position(|known| *known == name)
    } else {
        name.parse().ok()
    }
}

fn by_face(table: &Table<'_>, faces_c: Value<'_>, mesh: &Mesh, celsius: f64) -> Read<Vec<f64>> {
    let mut offsets_c = vec![0.0; mesh.faces().count()];
    for (name, face_c) in faces_c.named() {
        let number = face_number(table, name);
        let mut is_there = false;
        for (offset_c, given) in offsets_c.iter_mut().zip(mesh.given()) {
            if Some(*given) == number {
                *offset_c = face_c.number().unwrap_or(celsius) - celsius;
                is_there = true;
            }
        }
        if !is_there {
            let expected = "left, right, front, back, bottom, top of a cuboid, or a face's number from 0 of another shape";
            return Err(faces_c.refused(expected).into());
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
    table: &Table<'_>,
    grid: Value<'_>,
    mesh: &Mesh,
    stand: &Stand,
) -> Read<(Mesh, Vec<f64>)> {
    let cells = Cells::of(table, grid)?;
    let on = table.text("texture_on").unwrap_or("all");
    let number = face_number(table, on);
    if let Some(given) = table
        .get("texture_on")
        .filter(|_| on != "all" && number.is_none())
    {
        return Err(given.wrong().into());
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
    fn of(table: &Table<'_>, grid: Value<'_>) -> Read<Self> {
        let expected = "rows of the same number of temperatures, at least one of at least one";
        let columns = columns(grid, expected)?;
        let rows = grid.each().count();
        let limit = (limits::TEXTURE_CELLS_MAX, grid.span().start);
        let hint = "a sensor of 80 x 60 pixels cannot resolve finer cells";
        table
            .source
            .check_count("cells of a texture", columns * rows, limit, hint)?;
        let celsius = grid.each().flat_map(Value::each);
        let cells = Self {
            columns,
            rows,
            celsius: celsius.filter_map(|cell| cell.number()).collect(),
        };
        Ok(match table.text("texture_filter") {
            Some("bilinear") => cells.interpolated(),
            _ => cells,
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

fn heat(table: &Table<'_>) -> Read<Option<Transient>> {
    let Some(time_constant_s) = table.number("time_constant_s") else {
        return Ok(None);
    };
    let power_w = table.number("power_w").unwrap_or(0.0);
    let capacity = table.number("heat_capacity_j_per_k").unwrap_or(1.0);
    let mut on_s: Vec<[f64; 2]> = table.each("on_s").filter_map(|on| on.list()).collect();
    let starts_late = on_s.first().is_none_or(|first| first[0] >= 0.0);
    let is_sorted = on_s.as_flattened().is_sorted_by(|one, other| one < other);
    match table.get("on_s") {
        None => on_s.push([0.0, f64::INFINITY]),
        Some(given) if !starts_late || !is_sorted => {
            return Err(given.wrong().into());
        }
        Some(_) => {}
    }
    Ok(Some(Transient {
        time_constant_s,
        rise_c: power_w * time_constant_s / capacity,
        on_s,
    }))
}
