//! How warm people appear in the physical model: `T = ambient + share · (33 °C - ambient)`.
//!
//! The shares are **assumptions**: in a room of 19 to 20 °C a clothed person appears 21 to 24 °C warm, the head
//! warmest, and a coat lowers that by about 1 °C, as measured below a ceiling sensor; bare skin is 31 °C. Emissivities
//! are textbook values.

use crate::file::document::{AgentTable, ObjectTable, SceneTable};
use crate::file::reader::{Read, Reader};
use crate::file::rule::{EMISSIVITY, EMISSIVITY_PHYSICAL, TEMPERATURE};
use crate::model::{Model, PAPER, Warning};
use crate::radiometry::Surface;
use toml::Spanned;

/// The outermost layer of a body: its share and its emissivity.
const OUTSIDES: [(&str, [f64; 2]); 4] = [
    ("skin", [0.85, 0.98]),
    ("hair", [0.33, 0.95]),
    ("clothed", [0.22, 0.93]),
    ("coat", [0.14, 0.93]),
];

const SKIN_C: f64 = 33.0;

/// Above this, an agent's bare temperature is that of skin rather than clothes, °C.
const WARM_C: f64 = 26.0;

#[derive(Clone, Copy)]
pub(crate) struct Keys<'a> {
    temperature_c: &'a Option<Spanned<f64>>,
    emissivity: &'a Option<Spanned<f64>>,
    surface: &'a Option<Spanned<String>>,
}

impl<'a> Keys<'a> {
    pub(crate) const fn of_agent(table: &'a AgentTable) -> Self {
        Self {
            temperature_c: &table.temperature_c,
            emissivity: &table.emissivity,
            surface: &table.surface,
        }
    }

    pub(crate) const fn of_object(table: &'a ObjectTable) -> Self {
        Self {
            temperature_c: &table.temperature_c,
            emissivity: &table.emissivity,
            surface: &table.surface,
        }
    }
}

/// A body's temperature (by default `ambient_c`) and emissivity; in the physical model, `surface` takes precedence.
pub(crate) fn surface(reader: &Reader<'_>, keys: Keys<'_>, ambient_c: f64) -> Read<Surface> {
    let hint = "the outermost layer; for anything else give temperature_c and emissivity";
    let outside = reader.choice("surface", keys.surface, &OUTSIDES, hint)?;
    let default_c = outside.map_or(ambient_c, |_| PAPER.celsius);
    let given = Surface {
        celsius: reader.number_or(keys.temperature_c, &TEMPERATURE, default_c)?,
        emissivity: emissivity(reader, keys.emissivity)?,
    };
    Ok(match (reader.model, outside) {
        (Model::Physical, Some([share, emissivity])) => Surface {
            celsius: ambient_c + share * (SKIN_C - ambient_c),
            emissivity,
        },
        _ => given,
    })
}

/// Warns of agents as warm as skin without a stated surface or emissivity, which the physical model would show far too
/// warm.
pub(crate) fn warnings(reader: &Reader<'_>, tables: &SceneTable) -> Vec<Warning> {
    if reader.model != Model::Physical {
        return Vec::new();
    }
    let agents = tables.agent.iter().map(Spanned::get_ref);
    let bare = agents.filter_map(|agent| {
        let parts = agent.part.iter().map(|part| Keys::of_object(part.get_ref()));
        let mut all = std::iter::once(Keys::of_agent(agent)).chain(parts);
        let celsius = all.find_map(|keys| {
            let is_bare = keys.emissivity.is_none() && keys.surface.is_none();
            let warm = keys.temperature_c.as_ref().filter(|_| is_bare);
            warm.filter(|celsius| *celsius.get_ref() > WARM_C)
        })?;
        let problem = format!(
            "agent `{}` radiates like a surface of {} °C, but clothed people look like 21 to 24 °C in a room of 20",
            agent.name.get_ref(),
            celsius.get_ref()
        );
        let hint = "write surface = \"clothed\" (or \"skin\", \"hair\", \"coat\"), or add the emissivity if this temperature is intended";
        let place = reader.place(celsius.span().start);
        Some(Warning::WarmAsSkin(place.refused(problem, hint)))
    });
    bare.collect()
}

pub(crate) fn emissivity(reader: &Reader<'_>, given: &Option<Spanned<f64>>) -> Read<f64> {
    Ok(match reader.model {
        Model::Physical => reader.number_or(given, &EMISSIVITY_PHYSICAL, EMISSIVITY_OF_WALLS),
        _ => reader.number_or(given, &EMISSIVITY, PAPER.emissivity),
    }?)
}

/// Paint, paper, wood, plaster, plastic and cloth all have 0.9 to 0.97 at these wavelengths.
const EMISSIVITY_OF_WALLS: f64 = 0.95;
