//! From an object's keys to a body in the room: its shape, its place and what it is made of.

use crate::file::document::{AgentTable, ObjectTable, Triple};
use crate::file::files::Files;
use crate::file::rule::{PITCH, ROLL_OF_BODY, UNIT, YAW};
use crate::file::source::{Source, read_below};
use crate::file::spread::Stand;
use crate::file::{clothes, obj, spread};
use crate::geometry::angle::{rotation_x_deg, rotation_y_deg, rotation_z_deg};
use crate::geometry::cuboid::Cuboid;
use crate::geometry::mesh::{Mesh, MeshError};
use crate::heat::thermal::Thermal;
use crate::model::body::Body;
use crate::model::error::SceneError;
use crate::model::limits;
use crate::text::lengths::MM_PER_M;
use glam::{DMat3, DVec3};
use toml::Spanned;

pub(crate) fn object(
    source: &Source<'_>,
    table: &Spanned<ObjectTable>,
    ambient_c: f64,
    files: &dyn Files,
) -> Result<Body, SceneError> {
    let base_m = source.position_m(&table.get_ref().position_mm)?;
    body(source, table, base_m, ambient_c, files)
}

/// The bodies of an agent: its parts, whose positions count from its own, or the one that its own keys describe.
pub(crate) fn parts(
    source: &Source<'_>,
    table: &Spanned<AgentTable>,
    start_m: DVec3,
    ambient_c: f64,
    files: &dyn Files,
) -> Result<Vec<Body>, SceneError> {
    let keys = table.get_ref();
    if keys.part.is_empty() {
        return Ok(vec![single(source, table, start_m, ambient_c)?]);
    }
    let own_keys = [
        ("size_mm", keys.size_mm.is_some()),
        ("shape", keys.shape.is_some()),
        ("yaw_deg", keys.yaw_deg.is_some()),
        ("temperature_c", keys.temperature_c.is_some()),
        ("emissivity", keys.emissivity.is_some()),
        ("surface", keys.surface.is_some()),
        ("color", keys.color.is_some()),
    ];
    if let Some((key, _)) = own_keys.into_iter().find(|(_, given)| *given) {
        return Err(SceneError::KeysConflict {
            place: source.place(table.span().start),
            table: format!("agent `{}`", keys.name.get_ref()),
            key,
            other: "part",
            hint: "an agent of parts has name, parts and a place or a way; the rest belongs to each part",
        });
    }
    let build = |part: &Spanned<ObjectTable>| {
        if part.get_ref().material.is_some() {
            return Err(SceneError::KeysConflict {
                place: source.place(part.span().start),
                table: format!("part `{}`", part.get_ref().name.get_ref()),
                key: "material",
                other: "part",
                hint: "prints stay on objects, not on those who move",
            });
        }
        let offset_m = source.position_m(&part.get_ref().position_mm)?;
        body(source, part, start_m + offset_m, ambient_c, files)
    };
    keys.part.iter().map(build).collect()
}

fn single(
    source: &Source<'_>,
    table: &Spanned<AgentTable>,
    start_m: DVec3,
    ambient_c: f64,
) -> Result<Body, SceneError> {
    let keys = table.get_ref();
    let missing = |key| SceneError::MissingKey {
        place: source.place(table.span().start),
        table: format!("agent `{}`", keys.name.get_ref()),
        key,
        hint: "give the body's size_mm and temperature_c, or [[agent.part]] tables",
    };
    let size_mm = keys.size_mm.as_ref().ok_or_else(|| missing("size_mm"))?;
    if keys.temperature_c.is_none() && keys.surface.is_none() {
        return Err(missing("temperature_c"));
    }
    let made_of = clothes::Keys {
        temperature_c: keys.temperature_c.as_ref(),
        emissivity: keys.emissivity.as_ref(),
        surface: keys.surface.as_ref(),
    };
    let yaw_deg = source.number_or(keys.yaw_deg.as_ref(), &YAW, 0.0)?;
    let size_m = source.size_m(size_mm)?;
    let mesh = match simple(keys.shape.as_ref(), size_m) {
        Some(mesh) => mesh.placed(rotation_z_deg(yaw_deg), start_m),
        None if keys.shape.is_some() => return Err(unknown_shape(source, keys.shape.as_ref())),
        None => Mesh::of_cuboid(&Cuboid::new(start_m, size_m, yaw_deg)),
    };
    Ok(Body {
        name: source.name(&keys.name)?,
        base_m: start_m,
        mesh,
        surface: clothes::surface(source, made_of, ambient_c)?,
        color: color(source, keys.color.as_ref())?,
        thermal: Thermal::default(),
    })
}

fn body(
    source: &Source<'_>,
    table: &Spanned<ObjectTable>,
    base_m: DVec3,
    ambient_c: f64,
    files: &dyn Files,
) -> Result<Body, SceneError> {
    let keys = table.get_ref();
    let made_of = clothes::Keys {
        temperature_c: keys.temperature_c.as_ref(),
        emissivity: keys.emissivity.as_ref(),
        surface: keys.surface.as_ref(),
    };
    let surface = clothes::surface(source, made_of, ambient_c)?;
    let yaw_deg = source.number_or(keys.yaw_deg.as_ref(), &YAW, 0.0)?;
    let tilt = tilt(source, keys)?.unwrap_or(DMat3::IDENTITY);
    let whole = mesh(source, table, base_m, files)?;
    let stand = Stand::new(base_m, yaw_deg, tilt, surface.celsius);
    let (mesh, thermal) = spread::of(source, table, whole, &stand)?;
    Ok(Body {
        name: source.name(&keys.name)?,
        base_m,
        mesh,
        surface,
        color: color(source, keys.color.as_ref())?,
        thermal,
    })
}

/// How the body is rolled and pitched before it is turned; `None` if it stands upright.
fn tilt(source: &Source<'_>, keys: &ObjectTable) -> Result<Option<DMat3>, SceneError> {
    let pitch_deg = source.optional(keys.pitch_deg.as_ref(), &PITCH)?;
    let roll_deg = source.optional(keys.roll_deg.as_ref(), &ROLL_OF_BODY)?;
    let rotation =
        rotation_y_deg(pitch_deg.unwrap_or(0.0)) * rotation_x_deg(roll_deg.unwrap_or(0.0));
    Ok((pitch_deg.is_some() || roll_deg.is_some()).then_some(rotation))
}

fn mesh(
    source: &Source<'_>,
    table: &Spanned<ObjectTable>,
    base_m: DVec3,
    files: &dyn Files,
) -> Result<Mesh, SceneError> {
    let keys = table.get_ref();
    let yaw_deg = source.number_or(keys.yaw_deg.as_ref(), &YAW, 0.0)?;
    let tilt = tilt(source, keys)?;
    let rotation = rotation_z_deg(yaw_deg) * tilt.unwrap_or(DMat3::IDENTITY);
    let shape = keys
        .shape
        .as_ref()
        .map_or("cuboid", |shape| shape.get_ref());
    check_keys(source, table, shape)?;
    match (
        shape,
        &keys.size_mm,
        &keys.vertices_mm,
        &keys.faces,
        &keys.file,
    ) {
        ("polyhedron", _, Some(vertices_mm), Some(faces), _) => {
            Ok(polyhedron(source, keys, vertices_mm, faces)?.placed(rotation, base_m))
        }
        ("obj", _, _, _, Some(file)) => {
            Ok(of_file(source, keys, file, files)?.placed(rotation, base_m))
        }
        ("cuboid", Some(size_mm), ..) if tilt.is_none() => {
            let size_m = source.size_m(size_mm)?;
            Ok(Mesh::of_cuboid(&Cuboid::new(base_m, size_m, yaw_deg)))
        }
        (_, Some(size_mm), ..) => simple(keys.shape.as_ref(), source.size_m(size_mm)?)
            .map(|mesh| mesh.placed(rotation, base_m))
            .ok_or_else(|| unknown_shape(source, keys.shape.as_ref())),
        _ => Err(unknown_shape(source, keys.shape.as_ref())),
    }
}

/// A shape that its size alone describes, on the origin.
fn simple(shape: Option<&Spanned<String>>, size_m: DVec3) -> Option<Mesh> {
    match shape.map_or("cuboid", |shape| shape.get_ref()) {
        "cuboid" => Some(Mesh::of_cuboid(&Cuboid::new(DVec3::ZERO, size_m, 0.0))),
        "pyramid" => Some(Mesh::pyramid(size_m)),
        "ellipsoid" => Some(Mesh::ellipsoid(size_m)),
        "capsule" => Some(Mesh::capsule(size_m)),
        _ => None,
    }
}

fn unknown_shape(source: &Source<'_>, shape: Option<&Spanned<String>>) -> SceneError {
    source.refused(
        "shape",
        shape.map_or(0..0, Spanned::span),
        "\"cuboid\", \"pyramid\", \"ellipsoid\", \"capsule\", or for objects and parts \"polyhedron\" or \"obj\"",
        "scenes/README.md shows each; cuboid is the default",
    )
}

/// Each shape has its own keys: none is missing, none is there that would be passed over.
fn check_keys(
    source: &Source<'_>,
    table: &Spanned<ObjectTable>,
    shape: &str,
) -> Result<(), SceneError> {
    let keys = table.get_ref();
    let wanted: &[&str] = match shape {
        "cuboid" | "pyramid" | "ellipsoid" | "capsule" => &["size_mm"],
        "polyhedron" => &["vertices_mm", "faces"],
        "obj" => &["file"],
        _ => return Err(unknown_shape(source, keys.shape.as_ref())),
    };
    let given = [
        ("size_mm", keys.size_mm.is_some()),
        ("vertices_mm", keys.vertices_mm.is_some()),
        ("faces", keys.faces.is_some()),
        ("file", keys.file.is_some()),
        ("unit_mm", keys.unit_mm.is_some()),
    ];
    let place = || source.place(table.span().start);
    let titled = || format!("`{}`", keys.name.get_ref());
    for (key, is_given) in given {
        let is_wanted = wanted.contains(&key) || (key == "unit_mm" && shape == "obj");
        if is_given && !is_wanted {
            return Err(SceneError::KeysConflict {
                place: place(),
                table: titled(),
                key,
                other: "shape",
                hint: "cuboid, pyramid, ellipsoid and capsule have size_mm, polyhedron vertices_mm and faces, obj file and unit_mm",
            });
        }
        if !is_given && wanted.contains(&key) {
            return Err(SceneError::MissingKey {
                place: place(),
                table: titled(),
                key,
                hint: "cuboid, pyramid, ellipsoid and capsule need size_mm, polyhedron vertices_mm and faces, obj file",
            });
        }
    }
    Ok(())
}

fn polyhedron(
    source: &Source<'_>,
    keys: &ObjectTable,
    vertices_mm: &Spanned<Vec<Spanned<Triple>>>,
    faces: &Spanned<Vec<Vec<i64>>>,
) -> Result<Mesh, SceneError> {
    for (what, found, byte) in [
        (
            "vertices",
            vertices_mm.get_ref().len(),
            vertices_mm.span().start,
        ),
        ("faces", faces.get_ref().len(), faces.span().start),
    ] {
        let hint = "leave out what no sensor can see";
        source.check_count(what, found, limits::VERTICES_MAX, byte, hint)?;
    }
    let vertices_m = source.vertices_m(vertices_mm.get_ref())?;
    Mesh::new(vertices_m, faces.get_ref()).map_err(|error| no_solid(source, keys, faces, error))
}

fn no_solid(
    source: &Source<'_>,
    keys: &ObjectTable,
    faces: &Spanned<Vec<Vec<i64>>>,
    error: MeshError,
) -> SceneError {
    SceneError::NoSolid {
        place: source.place(faces.span().start),
        name: keys.name.get_ref().clone(),
        source: error,
        hint: "faces are lists of vertices, counted from 0, in the order of the outline",
    }
}

fn of_file(
    source: &Source<'_>,
    keys: &ObjectTable,
    file: &Spanned<String>,
    files: &dyn Files,
) -> Result<Mesh, SceneError> {
    let text = read_below(source, ("file", "OBJ file"), file, files)?;
    let unit_mm = source.number_or(keys.unit_mm.as_ref(), &UNIT, MM_PER_M)?;
    obj::read(
        file.get_ref(),
        &text,
        unit_mm / MM_PER_M,
        keys.name.get_ref(),
    )
}

/// Red, green and blue of `#rrggbb`.
pub(crate) fn color(
    source: &Source<'_>,
    given: Option<&Spanned<String>>,
) -> Result<Option<[u8; 3]>, SceneError> {
    let Some(given) = given else { return Ok(None) };
    let digits = given.get_ref().strip_prefix('#').filter(|digits| {
        digits.len() == 6 && digits.bytes().all(|digit| digit.is_ascii_hexdigit())
    });
    let parsed = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let Some(number) = parsed else {
        return Err(source.refused(
            "color",
            given.span(),
            "a colour as \"#rrggbb\"",
            "two hexadecimal digits each for red, green and blue",
        ));
    };
    let [_, red, green, blue] = number.to_be_bytes();
    Ok(Some([red, green, blue]))
}
