//! Reads a person: `person = { height_mm = 1750, build = "average", posture = "stand", clothing = "indoor" }`.

use crate::file::document::{AgentTable, PersonTable};
use crate::file::reader::{Read, Reader};
use crate::file::rule::{STATURE, YAW};
use crate::geometry::rotation_z_deg;
use crate::model::{Body, Clothing, Person, Posture};
use crate::text::MM_PER_M;
use glam::DVec3;
use toml::Spanned;

const POSTURES: [(&str, Posture); 4] = [
    ("stand", Posture::Stand),
    ("walk", Posture::Walk),
    ("sit", Posture::Sit),
    ("lie", Posture::Lie),
];

const CLOTHING: [(&str, Clothing); 3] = [
    ("light", Clothing::Light),
    ("indoor", Clothing::Indoor),
    ("coat", Clothing::Coat),
];

/// The person, if the agent is one, and its bodies at its start.
pub(crate) fn person(
    reader: &Reader<'_>,
    table: &Spanned<AgentTable>,
    start_m: DVec3,
    ambient_c: f64,
) -> Read<Option<(Person, Vec<Body>)>> {
    let keys = table.get_ref();
    let Some(given) = &keys.person else {
        return Ok(None);
    };
    let others = [
        ("part", !keys.part.is_empty()),
        ("size_mm", keys.size_mm.is_some()),
        ("shape", keys.shape.is_some()),
        ("temperature_c", keys.temperature_c.is_some()),
        ("emissivity", keys.emissivity.is_some()),
        ("surface", keys.surface.is_some()),
    ];
    if let Some((key, _)) = others.into_iter().find(|(_, given)| *given) {
        let title = format!("agent `{}`", keys.name.get_ref());
        let hint = "a person's body follows from height_mm, build, posture and clothing";
        return Err(reader.conflict(table.span().start, &title, [key, "person"], hint));
    }
    let person = read(reader, given.get_ref(), keys)?;
    let surfaces = reader.model.surfaces(&person, ambient_c);
    let color = super::body::color(reader, &keys.color)?;
    let parts = Body::segments_of(&person, start_m, surfaces, color);
    Ok(Some((person, parts)))
}

fn read(reader: &Reader<'_>, given: &PersonTable, keys: &AgentTable) -> Read<Person> {
    let hint = "stand is the default, walk that of an agent with a trajectory";
    let posture = reader.choice("posture", &given.posture, &POSTURES, hint)?;
    let default = match keys.trajectory {
        Some(_) => Posture::Walk,
        None => Posture::Stand,
    };
    let hint = "average is the default; girths are 0.9, 1 or 1.15 times the mean adult's";
    let girth = reader.choice("build", &given.build, &Person::BUILDS, hint)?;
    let hint = "indoor is the default; scenes/README.md says how warm each looks";
    let clothing = reader.choice("clothing", &given.clothing, &CLOTHING, hint)?;
    let yaw_deg = reader.number_or(&keys.yaw_deg, &YAW, 0.0)?;
    let height_mm = reader.number_or(&given.height_mm, &STATURE, Person::HEIGHT_M * MM_PER_M)?;
    let mut person = Person::new(
        height_mm / MM_PER_M,
        girth.unwrap_or(1.0),
        posture.unwrap_or(default),
        clothing.unwrap_or(Clothing::Indoor),
    );
    person.facing = rotation_z_deg(yaw_deg);
    Ok(person)
}
