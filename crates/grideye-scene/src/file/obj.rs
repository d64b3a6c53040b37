//! Reads vertices and faces from Wavefront OBJ, which every modeling program can write.

use crate::file::reader::{Read, Reader};
use crate::geometry::Mesh;
use crate::model::{SceneError, limits};
use crate::text::MM_PER_M;
use glam::DVec3;
use grideye_text::{Place, Table, Value, excerpt};

/// The surface of the vertices and faces given in the scene file itself.
pub(crate) fn given(vertices_mm: Value<'_>, faces: Value<'_>, name: &str) -> Read<Mesh> {
    let vertices_mm = vertices_mm.each().filter_map(|vertex| vertex.list());
    let vertices_m = vertices_mm.map(|vertex| DVec3::from_array(vertex) / MM_PER_M);
    let corners = |face: Value<'_>| face.each().filter_map(|corner| corner.whole()).collect();
    let corners: Vec<Vec<i64>> = faces.each().map(corners).collect();
    Mesh::new(vertices_m.collect(), &corners).map_err(|error| {
        let hint = "faces are lists of vertices, counted from 0, in the order of the outline";
        no_solid(faces.place(), name, &error, hint)
    })
}

/// The surface in the OBJ file that a table names.
pub(crate) fn named(
    reader: &Reader<'_>,
    table: &Table<'_>,
    file: Value<'_>,
    name: &str,
) -> Read<Mesh> {
    let text = reader.read_below("OBJ file", file)?;
    let unit_m = table.number("unit_mm").unwrap_or(MM_PER_M) / MM_PER_M;
    read(file.text().unwrap_or_default(), &text, unit_m, name)
}

/// The surface in an OBJ file with unit `unit_m`; lines other than `v` and `f`, textures and normals are ignored.
fn read(file: &str, text: &str, unit_m: f64, name: &str) -> Read<Mesh> {
    let (mut vertices_m, mut faces) = (Vec::new(), Vec::new());
    let mut first_face = 1;
    for (index, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default();
        let mut fields = content.split_ascii_whitespace();
        let place = || Place::of_line(file, index + 1);
        let malformed = |expected: &str| {
            let problem = format!("found `{}`, expected {expected}", excerpt(line));
            let hint = "only the lines `v x y z` and `f a b c` of an OBJ file are used, all others are ignored";
            place().refused(problem, hint)
        };
        let found = match fields.next() {
            Some("v") => {
                let vertex = vertex(fields).ok_or_else(|| {
                    malformed("`v` and three finite coordinates of at most 1000 m")
                })?;
                vertices_m.push(unit_m * vertex);
                vertices_m.len()
            }
            Some("f") => {
                let corners = corners(fields, vertices_m.len());
                faces.push(corners.ok_or_else(|| malformed("`f` and numbers of vertices"))?);
                if faces.len() == 1 {
                    first_face = index + 1;
                }
                faces.len()
            }
            _ => 0,
        };
        let limit = limits::VERTICES_MAX;
        if found > limit {
            let problem = format!("{found} vertices or faces, expected at most {limit}");
            let hint =
                "simplify the mesh: a sensor of 8 x 8 pixels sees no finer than a few centimeters";
            return Err(place().refused(problem, hint).into());
        }
    }
    Mesh::new(vertices_m, &faces).map_err(|error| {
        let hint = "faces count from 0 in this message and from 1 in the file; the line is that of the first face";
        no_solid(Place::of_line(file, first_face), name, &error, hint)
    })
}

fn no_solid(place: Place, name: &str, why: &str, hint: &str) -> SceneError {
    let problem = format!("`{name}` is not a solid: {why}");
    place.refused(problem, hint).into()
}

/// Three coordinates in the file's unit; a fourth, the weight of a rational curve, is ignored.
fn vertex<'a>(mut fields: impl Iterator<Item = &'a str>) -> Option<DVec3> {
    let mut coordinate = || {
        let number: f64 = fields.next()?.parse().ok()?;
        (number.abs() <= COORDINATE_MAX).then_some(number)
    };
    Some(DVec3::new(coordinate()?, coordinate()?, coordinate()?))
}

/// Corners as `5`, `5/1`, `5//7` or `5/1/7`: from 1, or backwards from -1, the newest vertex.
fn corners<'a>(fields: impl Iterator<Item = &'a str>, vertices: usize) -> Option<Vec<i64>> {
    let vertices = i64::try_from(vertices).ok()?;
    let index = |field: &str| {
        let number: i64 = field.split('/').next()?.parse().ok()?;
        match number {
            0 => None,
            1.. => Some(number - 1),
            _ => vertices.checked_add(number),
        }
    };
    fields.map(index).collect()
}

const COORDINATE_MAX: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: &str = "# a comment\no thing\nv 0 0 0\nv 1 0 0 1.0\nv 0 1 0 # corner\nvn 0 0 1\nv 0 0 1\n\
        f 1 3 2\nf 1/1 2/1 4/2\nf 2//1 3//1 4//1\nf -1 -2 -4\n";

    #[test]
    fn all_ways_to_name_a_corner_are_read() {
        let mesh = read("t.obj", TETRAHEDRON, 0.001, "t").unwrap();
        assert_eq!(mesh.vertices_m()[1], DVec3::new(0.001, 0.0, 0.0));
        assert_eq!(mesh.faces().count(), 4);
        assert_eq!(mesh.enclosure(), crate::geometry::Enclosure::Convex);
    }

    #[test]
    fn a_wrong_line_is_named() {
        for (line, expected) in [
            (
                "v 1 2",
                "13:1: found `v 1 2`, expected `v` and three finite coordinates of at most 1000 m",
            ),
            ("v 1 2 nan", "13:1: found `v 1 2 nan`"),
            (
                "f 1 2 x",
                "13:1: found `f 1 2 x`, expected `f` and numbers of vertices",
            ),
            ("f 0 1 2", "13:1: found `f 0 1 2`"),
            (
                "f 1 2 9",
                "8:1: `thing` is not a solid: face 4 names vertex 8, expected 0 to 3",
            ),
            (
                "f 1 2",
                "8:1: `thing` is not a solid: face 4 has 2 corners, expected at least 3",
            ),
        ] {
            let text = format!("{TETRAHEDRON}\n{line}\n");
            let message = read("t.obj", &text, 1.0, "thing").unwrap_err().to_string();
            let expected = format!("t.obj:{expected}");
            assert!(message.starts_with(&expected), "{message}");
        }
    }
}
