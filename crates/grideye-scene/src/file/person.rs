//! Reads a person: `person = { height_mm = 1750, build = "average", posture = "stand", clothing = "indoor" }`.

use crate::file::keys::rgb;
use crate::file::reader::Reader;
use crate::geometry::rotation_z_deg;
use crate::model::{Body, Clothing, Person, Posture};
use crate::text::MM_PER_M;
use glam::DVec3;
use grideye_text::Table;

/// The person, if the agent is one, and its bodies at its start.
pub(crate) fn person(
    reader: &Reader<'_>,
    agent: &Table<'_>,
    start_m: DVec3,
    ambient_c: f64,
) -> Option<(Person, Vec<Body>)> {
    let person = read(agent, &agent.table("person")?);
    let surfaces = reader.model.surfaces(&person, ambient_c);
    let color = agent.text("color").and_then(rgb);
    let parts = Body::segments_of(&person, start_m, surfaces, color);
    Some((person, parts))
}

fn read(agent: &Table<'_>, table: &Table<'_>) -> Person {
    let posture = table.text("posture").and_then(Posture::from_name);
    let default = match agent.has("trajectory") {
        true => Posture::Walk,
        false => Posture::Stand,
    };
    let names = Clothing::NAMES.map(|(name, clothing)| (name, clothing.clo));
    let clo = number(table, "clothing", &names);
    let height_mm = table.number("height_mm");
    let mut person = Person::new(
        height_mm.map_or(Person::HEIGHT_M, |height_mm| height_mm / MM_PER_M),
        number(table, "build", &Person::BUILDS).unwrap_or(1.0),
        posture.unwrap_or(default),
        clo.map_or(Clothing::INDOOR, |clo| Clothing { clo }),
    );
    person.facing = rotation_z_deg(agent.number("yaw_deg").unwrap_or_default());
    person
}

/// A number, or what a name stands for.
fn number(table: &Table<'_>, key: &str, names: &[(&str, f64)]) -> Option<f64> {
    let name = table.text(key);
    let named = names.iter().find(|(known, _)| Some(*known) == name);
    named.map(|(_, number)| *number).or(table.number(key))
}
