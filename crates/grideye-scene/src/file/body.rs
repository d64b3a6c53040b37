//! Builds a body from an object's keys: its shape, place and material.

use crate::file::keys::rgb;
use crate::file::reader::{Read, Reader, meters, name, present};
use crate::file::spread::{self, Stand};
use crate::file::{clothes, obj};
use crate::geometry::{Cuboid, Mesh, rotation_x_deg, rotation_y_deg, rotation_z_deg};
use crate::heat::Thermal;
use crate::model::{Body, SceneError, limits};
use glam::{DMat3, DVec3};
use grideye_text::Table;

pub(crate) fn object(reader: &Reader<'_>, table: &Table<'_>, ambient_c: f64) -> Read<Body> {
    let base_m = meters(table, "position_mm").unwrap_or_default();
    body(reader, table, base_m, ambient_c)
}

/// The bodies of an agent: its parts, placed relative to the agent, or the single body of its own keys.
pub(crate) fn parts(
    reader: &Reader<'_>,
    table: &Table<'_>,
    start_m: DVec3,
    ambient_c: f64,
) -> Read<Vec<Body>> {
    let parts = present(table, "part");
    if parts.is_empty() {
        return Ok(vec![single(reader, table, start_m, ambient_c)?]);
    }
    let build = |part: &Table<'_>| {
        if part.has("material") {
            let problem = format!("part {} has both `material` and `part`", part.title());
            let hint = "prints are left on objects, not on agents";
            return Err(part.source.place(part.start).refused(problem, hint).into());
        }
        let offset_m = meters(part, "position_mm").unwrap_or_default();
        body(reader, part, start_m + offset_m, ambient_c)
    };
    parts.iter().map(build).collect()
}

fn single(reader: &Reader<'_>, table: &Table<'_>, start_m: DVec3, ambient_c: f64) -> Read<Body> {
    let hint = "give the body's size_mm and temperature_c, or [[agent.part]] tables";
    let size_m = meters(table, "size_mm").ok_or_else(|| table.missing("size_mm", hint))?;
    if !table.has("temperature_c") && !table.has("surface") {
        return Err(table.missing("temperature_c", hint).into());
    }
    let yaw_deg = table.number("yaw_deg").unwrap_or_default();
    let mesh = simple(table, size_m).ok_or_else(|| unknown_shape(table))?;
    Ok(Body {
        mesh: mesh.placed(rotation_z_deg(yaw_deg), start_m),
        name: name(table),
        base_m: start_m,
        surface: clothes::surface(reader, table, ambient_c)?,
        color: table.text("color").and_then(rgb),
        thermal: Thermal::default(),
    })
}

fn body(reader: &Reader<'_>, table: &Table<'_>, base_m: DVec3, ambient_c: f64) -> Read<Body> {
    let surface = clothes::surface(reader, table, ambient_c)?;
    let yaw_deg = table.number("yaw_deg").unwrap_or_default();
    let tilt = tilt(table);
    let rotation = rotation_z_deg(yaw_deg) * tilt.unwrap_or(DMat3::IDENTITY);
    let whole = mesh(reader, table, (yaw_deg, tilt.is_none()), rotation, base_m)?;
    let celsius = surface.celsius;
    let stand = Stand {
        base_m,
        rotation,
        celsius,
    };
    let (mesh, thermal) = spread::of(table, whole, &stand)?;
    Ok(Body {
        name: name(table),
        base_m,
        mesh,
        surface,
        color: table.text("color").and_then(rgb),
        thermal,
    })
}

/// The body's roll and pitch, applied before its yaw; `None` if it stands upright.
fn tilt(table: &Table<'_>) -> Option<DMat3> {
    let [pitch_deg, roll_deg] = ["pitch_deg", "roll_deg"].map(|key| table.number(key));
    pitch_deg.or(roll_deg)?;
    Some(rotation_y_deg(pitch_deg.unwrap_or(0.0)) * rotation_x_deg(roll_deg.unwrap_or(0.0)))
}

fn mesh(
    reader: &Reader<'_>,
    table: &Table<'_>,
    (yaw_deg, is_upright): (f64, bool),
    rotation: DMat3,
    base_m: DVec3,
) -> Read<Mesh> {
    check_shape(table)?;
    if let Some(size_m) = meters(table, "size_mm") {
        if is_upright && shape(table) == "cuboid" {
            return Ok(Mesh::of_cuboid(&Cuboid::new(base_m, size_m, yaw_deg)));
        }
        let mesh = simple(table, size_m).ok_or_else(|| unknown_shape(table))?;
        return Ok(mesh.placed(rotation, base_m));
    }
    let name = table.text("name").unwrap_or_default();
    let given = [table.get("vertices_mm"), table.get("faces")];
    let mesh = match (given, table.get("file")) {
        ([Some(vertices), Some(faces)], _) => {
            let hint = "omit what no sensor can see";
            for (what, given) in [("vertices", vertices), ("faces", faces)] {
                let limit = (limits::VERTICES_MAX, given.span().start);
                table
                    .source
                    .check_count(what, given.each().count(), limit, hint)?;
            }
            obj::given(vertices, faces, name)?
        }
        (_, Some(file)) => obj::named(reader, table, file, name)?,
        _ => return Err(unknown_shape(table)),
    };
    Ok(mesh.placed(rotation, base_m))
}

fn shape<'d>(table: &Table<'d>) -> &'d str {
    table.text("shape").unwrap_or("cuboid")
}

fn simple(table: &Table<'_>, size_m: DVec3) -> Option<Mesh> {
    match shape(table) {
        "cuboid" => Some(Mesh::of_cuboid(&Cuboid::new(DVec3::ZERO, size_m, 0.0))),
        "pyramid" => Some(Mesh::pyramid(size_m)),
        "ellipsoid" => Some(Mesh::ellipsoid(size_m)),
        "capsule" => Some(Mesh::capsule(size_m)),
        _ => None,
    }
}

fn unknown_shape(table: &Table<'_>) -> SceneError {
    let refusal = match table.get("shape") {
        Some(shape) => shape.wrong(),
        None => table.missing("shape", "scenes/README.md shows each"),
    };
    refusal.into()
}

/// Checks that the shape's keys are all present and that no other shape's keys are.
fn check_shape(table: &Table<'_>) -> Read<()> {
    let (needed, possible): (&[&str], &[&str]) = match shape(table) {
        "polyhedron" => (&["vertices_mm", "faces"], &[]),
        "obj" => (&["file"], &["unit_mm"]),
        _ => (&["size_mm"], &[]),
    };
    for key in ["size_mm", "vertices_mm", "faces", "file", "unit_mm"] {
        if table.has(key) && !needed.contains(&key) && !possible.contains(&key) {
            let hint = "cuboid, pyramid, ellipsoid and capsule have size_mm, polyhedron vertices_mm and faces, obj file and unit_mm";
            return Err(table.conflict(table.start, [key, "shape"], hint).into());
        }
        if !table.has(key) && needed.contains(&key) {
            let hint = "cuboid, pyramid, ellipsoid and capsule need size_mm, polyhedron vertices_mm and faces, obj file";
            return Err(table.missing(key, hint).into());
        }
    }
    Ok(())
}
