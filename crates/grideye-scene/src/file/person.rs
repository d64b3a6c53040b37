//! Reads a person: `person = { height_mm = 1750, build = "average", posture = "stand", clothing = "indoor" }`.

use crate::file::document::{AgentTable, NameOrNumber, PersonTable};
use crate::file::reader::{Read, Reader};
use crate::file::rule::{BUILD, CLOTHING, STATURE, YAW};
use crate::geometry::rotation_z_deg;
use crate::model::{Body, Clothing, Person, Posture};
use crate::text::MM_PER_M;
use crate::text::Rule;
use glam::DVec3;
use toml::Spanned;

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
    let postures = Posture::ALL.map(|posture| (posture.name(), posture));
    let posture = reader.choice("posture", &given.posture, &postures, hint)?;
    let default = match keys.trajectory {
        Some(_) => Posture::Walk,
        None => Posture::Stand,
    };
    let girth = number(reader, &given.build, &Person::BUILDS, &BUILD)?;
    let names = Clothing::NAMES.map(|(name, clothing)| (name, clothing.clo));
    let clo = number(reader, &given.clothing, &names, &CLOTHING)?;
    let yaw_deg = reader.number_or(&keys.yaw_deg, &YAW, 0.0)?;
    let height_mm = reader.number_or(&given.height_mm, &STATURE, Person::HEIGHT_M * MM_PER_M)?;
    let mut person = Person::new(
        height_mm / MM_PER_M,
        girth.unwrap_or(1.0),
        posture.unwrap_or(default),
        clo.map_or(Clothing::INDOOR, |clo| Clothing { clo }),
    );
    person.facing = rotation_z_deg(yaw_deg);
    Ok(person)
}

/// A number, or what a name stands for.
fn number(
    reader: &Reader<'_>,
    given: &Option<Spanned<NameOrNumber>>,
    names: &[(&str, f64)],
    rule: &Rule,
) -> Read<Option<f64>> {
    let Some(given) = given else { return Ok(None) };
    let number = match given.get_ref() {
        NameOrNumber::Number(number) => Some(*number).filter(|number| (rule.holds)(*number)),
        NameOrNumber::Name(name) => {
            let named = names.iter().find(|(word, _)| word == name);
            named.map(|(_, number)| *number)
        }
    };
    match number {
        None => Err(reader
            .refused(rule.key, given.span(), rule.expected, rule.hint)
            .into()),
        number => Ok(number),
    }
}
