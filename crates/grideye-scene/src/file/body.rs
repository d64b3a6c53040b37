//! Builds a body from an object's keys: its shape, place and material.

use crate::file::clothes::{self, Keys};
use crate::file::document::{AgentTable, ObjectTable};
use crate::file::obj;
use crate::file::reader::{Read, Reader};
use crate::file::rule::{PITCH, ROLL_OF_BODY, YAW};
use crate::file::spread::{self, Stand};
use crate::geometry::{Cuboid, Mesh, rotation_x_deg, rotation_y_deg, rotation_z_deg};
use crate::heat::Thermal;
use crate::model::{Body, SceneError, limits};
use glam::{DMat3, DVec3};
use toml::Spanned;

pub(crate) fn object(
    reader: &Reader<'_>,
    table: &Spanned<ObjectTable>,
    ambient_c: f64,
) -> Read<Body> {
    let base_m = reader.position_m(&table.get_ref().position_mm)?;
    body(reader, table, base_m, ambient_c)
}

/// The bodies of an agent: its parts, placed relative to the agent, or the single body of its own keys.
pub(crate) fn parts(
    reader: &Reader<'_>,
    table: &Spanned<AgentTable>,
    start_m: DVec3,
    ambient_c: f64,
) -> Read<Vec<Body>> {
    let keys = table.get_ref();
    if keys.part.is_empty() {
        return Ok(vec![single(reader, table, start_m, ambient_c)?]);
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
        let title = format!("agent `{}`", keys.name.get_ref());
        let hint = "an agent with parts has a name, parts and a position or a trajectory; all other keys go into its parts";
        return Err(reader.conflict(table.span().start, &title, [key, "part"], hint));
    }
    let build = |part: &Spanned<ObjectTable>| {
        let keys = part.get_ref();
        if keys.material.is_some() {
            let title = format!("part `{}`", keys.name.get_ref());
            let hint = "prints are left on objects, not on agents";
            return Err(reader.conflict(part.span().start, &title, ["material", "part"], hint));
        }
        let offset_m = reader.position_m(&keys.position_mm)?;
        body(reader, part, start_m + offset_m, ambient_c)
    };
    keys.part.iter().map(build).collect()
}

fn single(
    reader: &Reader<'_>,
    table: &Spanned<AgentTable>,
    start_m: DVec3,
    ambient_c: f64,
) -> Read<Body> {
    let keys = table.get_ref();
    let missing = |key| {
        let title = format!("agent `{}`", keys.name.get_ref());
        let hint = "give the body's size_mm and temperature_c, or [[agent.part]] tables";
        reader.missing(table.span().start, &title, key, hint)
    };
    let size_mm = keys.size_mm.as_ref().ok_or_else(|| missing("size_mm"))?;
    if keys.temperature_c.is_none() && keys.surface.is_none() {
        return Err(missing("temperature_c"));
    }
    let yaw_deg = reader.number_or(&keys.yaw_deg, &YAW, 0.0)?;
    let size_m = reader.size_m(size_mm)?;
    Ok(Body {
        mesh: simple(reader, &keys.shape, size_m)?.placed(rotation_z_deg(yaw_deg), start_m),
        name: reader.name(&keys.name)?,
        base_m: start_m,
        surface: clothes::surface(reader, Keys::of_agent(keys), ambient_c)?,
        color: color(reader, &keys.color)?,
        thermal: Thermal::default(),
    })
}

fn body(
    reader: &Reader<'_>,
    table: &Spanned<ObjectTable>,
    base_m: DVec3,
    ambient_c: f64,
) -> Read<Body> {
    let keys = table.get_ref();
    let surface = clothes::surface(reader, Keys::of_object(keys), ambient_c)?;
    let yaw_deg = reader.number_or(&keys.yaw_deg, &YAW, 0.0)?;
    let tilt = tilt(reader, keys)?;
    let rotation = rotation_z_deg(yaw_deg) * tilt.unwrap_or(DMat3::IDENTITY);
    let whole = mesh(reader, table, (yaw_deg, tilt.is_none()), rotation, base_m)?;
    let celsius = surface.celsius;
    let stand = Stand {
        base_m,
        rotation,
        celsius,
    };
    let (mesh, thermal) = spread::of(reader, table, whole, &stand)?;
    Ok(Body {
        name: reader.name(&keys.name)?,
        base_m,
        mesh,
        surface,
        color: color(reader, &keys.color)?,
        thermal,
    })
}

/// The body's roll and pitch, applied before its yaw; `None` if it stands upright.
fn tilt(reader: &Reader<'_>, keys: &ObjectTable) -> Read<Option<DMat3>> {
    let pitch_deg = reader.optional(&keys.pitch_deg, &PITCH)?;
    let roll_deg = reader.optional(&keys.roll_deg, &ROLL_OF_BODY)?;
    let rotation =
        rotation_y_deg(pitch_deg.unwrap_or(0.0)) * rotation_x_deg(roll_deg.unwrap_or(0.0));
    Ok((pitch_deg.is_some() || roll_deg.is_some()).then_some(rotation))
}

fn mesh(
    reader: &Reader<'_>,
    table: &Spanned<ObjectTable>,
    (yaw_deg, is_upright): (f64, bool),
    rotation: DMat3,
    base_m: DVec3,
) -> Read<Mesh> {
    let keys = table.get_ref();
    check_keys(reader, table)?;
    let mesh = match (&keys.size_mm, &keys.vertices_mm, &keys.faces, &keys.file) {
        (Some(size_mm), ..) => {
            let size_m = reader.size_m(size_mm)?;
            if is_upright && word(&keys.shape) == "cuboid" {
                return Ok(Mesh::of_cuboid(&Cuboid::new(base_m, size_m, yaw_deg)));
            }
            simple(reader, &keys.shape, size_m)?
        }
        (_, Some(vertices), Some(faces), _) => {
            let hint = "omit what no sensor can see";
            for (what, found, byte) in [
                ("vertices", vertices.get_ref().len(), vertices.span().start),
                ("faces", faces.get_ref().len(), faces.span().start),
            ] {
                reader.check_count(what, found, limits::VERTICES_MAX, byte, hint)?;
            }
            obj::given(reader, vertices, faces, keys.name.get_ref())?
        }
        (_, _, _, Some(file)) => obj::named(reader, file, &keys.unit_mm, keys.name.get_ref())?,
        _ => return Err(unknown_shape(reader, &keys.shape)),
    };
    Ok(mesh.placed(rotation, base_m))
}

fn word(shape: &Option<Spanned<String>>) -> &str {
    shape.as_ref().map_or("cuboid", |shape| shape.get_ref())
}

fn simple(reader: &Reader<'_>, shape: &Option<Spanned<String>>, size_m: DVec3) -> Read<Mesh> {
    match word(shape) {
        "cuboid" => Ok(Mesh::of_cuboid(&Cuboid::new(DVec3::ZERO, size_m, 0.0))),
        "pyramid" => Ok(Mesh::pyramid(size_m)),
        "ellipsoid" => Ok(Mesh::ellipsoid(size_m)),
        "capsule" => Ok(Mesh::capsule(size_m)),
        _ => Err(unknown_shape(reader, shape)),
    }
}

fn unknown_shape(reader: &Reader<'_>, shape: &Option<Spanned<String>>) -> SceneError {
    let expected = "\"cuboid\", \"pyramid\", \"ellipsoid\", \"capsule\", or for objects and parts \"polyhedron\" or \"obj\"";
    let hint = "scenes/README.md shows each; cuboid is the default";
    let span = shape.as_ref().map_or(0..0, Spanned::span);
    reader.refused("shape", span, expected, hint).into()
}

/// Checks that the shape's keys are all present and that no other shape's keys are.
fn check_keys(reader: &Reader<'_>, table: &Spanned<ObjectTable>) -> Read<()> {
    let keys = table.get_ref();
    let shape = word(&keys.shape);
    let wanted: &[&str] = match shape {
        "cuboid" | "pyramid" | "ellipsoid" | "capsule" => &["size_mm"],
        "polyhedron" => &["vertices_mm", "faces"],
        "obj" => &["file"],
        _ => return Err(unknown_shape(reader, &keys.shape)),
    };
    let given = [
        ("size_mm", keys.size_mm.is_some()),
        ("vertices_mm", keys.vertices_mm.is_some()),
        ("faces", keys.faces.is_some()),
        ("file", keys.file.is_some()),
        ("unit_mm", keys.unit_mm.is_some()),
    ];
    let start = table.span().start;
    let title = format!("`{}`", keys.name.get_ref());
    for (key, is_given) in given {
        let is_wanted = wanted.contains(&key);
        if is_given && !is_wanted && !(key == "unit_mm" && shape == "obj") {
            let hint = "cuboid, pyramid, ellipsoid and capsule have size_mm, polyhedron vertices_mm and faces, obj file and unit_mm";
            return Err(reader.conflict(start, &title, [key, "shape"], hint));
        }
        if !is_given && is_wanted {
            let hint = "cuboid, pyramid, ellipsoid and capsule need size_mm, polyhedron vertices_mm and faces, obj file";
            return Err(reader.missing(start, &title, key, hint));
        }
    }
    Ok(())
}

pub(crate) fn color(reader: &Reader<'_>, given: &Option<Spanned<String>>) -> Read<Option<[u8; 3]>> {
    let Some(given) = given else { return Ok(None) };
    let digits = given.get_ref().strip_prefix('#').filter(|digits| {
        digits.len() == 6 && digits.bytes().all(|digit| digit.is_ascii_hexdigit())
    });
    let parsed = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let Some(number) = parsed else {
        let hint = "two hexadecimal digits each for red, green and blue";
        let expected = "a color as \"#rrggbb\"";
        return Err(reader.refused("color", given.span(), expected, hint).into());
    };
    let [_, red, green, blue] = number.to_be_bytes();
    Ok(Some([red, green, blue]))
}
