//! How warm people appear in the physical model: `T = ambient + share · (33 °C - ambient)`.
//!
//! The shares are **assumptions**: in a room of 19 to 20 °C a clothed person appears 21 to 24 °C warm, the head
//! warmest, and a coat lowers that by about 1 °C, as measured below a ceiling sensor; bare skin is 31 °C. Emissivities
//! are textbook values.

use crate::file::keys::EMISSIVITIES;
use crate::file::reader::{Read, Reader, present};
use crate::model::{Model, PAPER, Warning};
use crate::radiometry::Surface;
use grideye_text::{Number, Table};

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

/// A body's temperature (by default `ambient_c`) and emissivity; in the physical model, `surface` takes precedence.
pub(crate) fn surface(reader: &Reader<'_>, table: &Table<'_>, ambient_c: f64) -> Read<Surface> {
    let named = table.text("surface");
    let outside = OUTSIDES.iter().find(|(name, _)| named == Some(*name));
    let default_c = outside.map_or(ambient_c, |_| PAPER.celsius);
    let given = Surface {
        celsius: table.number("temperature_c").unwrap_or(default_c),
        emissivity: emissivity(reader, table)?,
    };
    Ok(match (reader.model, outside) {
        (Model::Physical, Some((_, [share, emissivity]))) => Surface {
            celsius: ambient_c + share * (SKIN_C - ambient_c),
            emissivity: *emissivity,
        },
        _ => given,
    })
}

/// Warns of agents as warm as skin without a stated surface or emissivity, which the physical model would show far too
/// warm.
pub(crate) fn warnings(reader: &Reader<'_>, agents: &[Table<'_>]) -> Vec<Warning> {
    if reader.model != Model::Physical {
        return Vec::new();
    }
    let bare = agents.iter().filter_map(|agent| {
        let bodies = std::iter::once(*agent).chain(present(agent, "part"));
        let bare = bodies.filter(|body| !body.has("emissivity") && !body.has("surface"));
        let mut temperatures = bare.filter_map(|body| body.get("temperature_c"));
        let given = temperatures.find(|given| given.number() > Some(WARM_C))?;
        let problem = format!(
            "{} radiates like a surface of {} °C, but clothed people look like 21 to 24 °C in a room of 20",
            agent.title(),
            given.number()?
        );
        let hint = "write surface = \"clothed\" (or \"skin\", \"hair\", \"coat\"), or add the emissivity if this temperature is intended";
        Some(Warning::WarmAsSkin(given.place().refused(problem, hint)))
    });
    bare.collect()
}

pub(crate) fn emissivity(reader: &Reader<'_>, table: &Table<'_>) -> Read<f64> {
    let Some(given) = table.get("emissivity") else {
        return Ok(match reader.model {
            Model::Physical => EMISSIVITY_OF_WALLS,
            _ => PAPER.emissivity,
        });
    };
    let number = given.number().unwrap_or_default();
    match reader.model {
        Model::Paper | Model::PaperGrid if !EMISSIVITIES.holds(number) => Err(given.wrong().into()),
        Model::Physical if !Number::Within(0.0, 1.0).holds(number) => {
            let hint = "skin has 0.98, cloth 0.9 to 0.95, a mirror for heat 0";
            Err(given.refused_with("a number from 0 to 1", hint).into())
        }
        _ => Ok(number),
    }
}

/// Paint, paper, wood, plaster, plastic and cloth all have 0.9 to 0.97 at these wavelengths.
const EMISSIVITY_OF_WALLS: f64 = 0.95;
