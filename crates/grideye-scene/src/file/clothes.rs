//! What people look like from outside: the temperatures and emissivities that the physical model takes for them.
//!
//! A body keeps its skin at about 33 °C, and what covers it lets a share of the difference to the room come through:
//! `T = ambient + share · (33 °C - ambient)`. The shares are **assumptions**: chosen so that in a room of 19 to 20 °C
//! a clothed person looks 21 to 24 °C, the head warmest, which is what was measured below a ceiling sensor with four
//! persons; a coat takes off about 1 °C of what clothes show, as measured as well; bare skin is 31 °C in a room of 20.
//! They are lower than the insulation of the cloth alone would have them, since a sensor sees cloth that hangs free and
//! surfaces that slant away. Emissivities are textbook values: skin 0.98, cloth 0.90 to 0.95.
//!
//! | outside | share | emissivity | in a room of 20 °C |
//! |---|---|---|---|
//! | skin | 0.85 | 0.98 | 31.1 °C |
//! | hair | 0.33 | 0.95 | 24.3 °C |
//! | clothed | 0.22 | 0.93 | 22.9 °C |
//! | coat | 0.14 | 0.93 | 21.8 °C |

use crate::file::document::SceneTable;
use crate::file::rule::{EMISSIVITY, EMISSIVITY_PHYSICAL, TEMPERATURE};
use crate::file::source::Source;
use crate::model::error::{SceneError, Warning};
use crate::model::scene::Model;
use crate::radiometry::perceived::Surface;
use toml::Spanned;

/// What is outermost on a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outside {
    Skin,
    Hair,
    Clothed,
    Coat,
}

/// Temperature of skin that is covered, °C.
const SKIN_C: f64 = 33.0;

/// What the paper's model takes for a person without a `temperature_c`: with law B, bodies of 28 to 30 °C came nearest
/// to real frames.
const PAPER_C: f64 = 29.0;

/// From this on, a bare temperature of an agent is that of skin rather than that of clothes, °C.
const WARM_C: f64 = 26.0;

impl Outside {
    const ALL: [(&'static str, Self); 4] = [
        ("skin", Self::Skin),
        ("hair", Self::Hair),
        ("clothed", Self::Clothed),
        ("coat", Self::Coat),
    ];

    const fn share(self) -> f64 {
        match self {
            Self::Skin => 0.85,
            Self::Hair => 0.33,
            Self::Clothed => 0.22,
            Self::Coat => 0.14,
        }
    }

    const fn emissivity(self) -> f64 {
        match self {
            Self::Skin => 0.98,
            Self::Hair => 0.95,
            Self::Clothed | Self::Coat => 0.93,
        }
    }
}

/// The keys that say what a surface is.
#[derive(Clone, Copy)]
pub(crate) struct Keys<'a> {
    pub(crate) temperature_c: Option<&'a Spanned<f64>>,
    pub(crate) emissivity: Option<&'a Spanned<f64>>,
    pub(crate) surface: Option<&'a Spanned<String>>,
}

/// Temperature and emissivity of a body; `ambient_c` where nothing is said of the temperature.
///
/// In the physical model, `surface` says both, and what the other keys say is the paper's.
pub(crate) fn surface(
    source: &Source<'_>,
    keys: Keys<'_>,
    ambient_c: f64,
) -> Result<Surface, SceneError> {
    let outside = outside(source, keys.surface)?;
    let given = Surface {
        celsius: source.number_or(
            keys.temperature_c,
            &TEMPERATURE,
            outside.map_or(ambient_c, |_| PAPER_C),
        )?,
        emissivity: emissivity(source, keys.emissivity)?,
    };
    Ok(match (source.model, outside) {
        (Model::Physical, Some(outside)) => Surface {
            celsius: ambient_c + outside.share() * (SKIN_C - ambient_c),
            emissivity: outside.emissivity(),
        },
        _ => given,
    })
}

fn outside(
    source: &Source<'_>,
    given: Option<&Spanned<String>>,
) -> Result<Option<Outside>, SceneError> {
    let Some(given) = given else { return Ok(None) };
    let found = Outside::ALL
        .iter()
        .find(|(name, _)| name == given.get_ref());
    found.map(|(_, outside)| Some(*outside)).ok_or_else(|| {
        source.refused(
            "surface",
            given.span(),
            "\"skin\", \"hair\", \"clothed\" or \"coat\"",
            "what is outermost; for anything else give temperature_c and emissivity",
        )
    })
}

/// Agents as warm as skin, of whom nothing says that they are naked: in the physical model they would shine.
pub(crate) fn warnings(source: &Source<'_>, tables: &SceneTable) -> Vec<Warning> {
    if source.model == Model::Paper {
        return Vec::new();
    }
    let mut warnings = Vec::new();
    for table in &tables.agent {
        let agent = table.get_ref();
        let own = Keys {
            temperature_c: agent.temperature_c.as_ref(),
            emissivity: agent.emissivity.as_ref(),
            surface: agent.surface.as_ref(),
        };
        let parts = agent.part.iter().map(|part| {
            let part = part.get_ref();
            Keys {
                temperature_c: part.temperature_c.as_ref(),
                emissivity: part.emissivity.as_ref(),
                surface: part.surface.as_ref(),
            }
        });
        let bare = std::iter::once(own)
            .chain(parts)
            .find_map(|keys| match keys {
                Keys {
                    temperature_c: Some(celsius),
                    emissivity: None,
                    surface: None,
                } if *celsius.get_ref() > WARM_C => Some(celsius),
                _ => None,
            });
        if let Some(celsius) = bare {
            warnings.push(Warning::WarmAsSkin {
                place: source.place(celsius.span().start),
                name: agent.name.get_ref().clone(),
                celsius: *celsius.get_ref(),
            });
        }
    }
    warnings
}

pub(crate) fn emissivity(
    source: &Source<'_>,
    given: Option<&Spanned<f64>>,
) -> Result<f64, SceneError> {
    match source.model {
        Model::Paper => source.number_or(given, &EMISSIVITY, EMISSIVITY_DEFAULT),
        Model::Physical => source.number_or(given, &EMISSIVITY_PHYSICAL, EMISSIVITY_OF_WALLS),
    }
}

/// PeerJ CS 11:e3124, "Perceived temperature calculation": opaque or dark surfaces such as fabrics.
const EMISSIVITY_DEFAULT: f64 = 0.8;

/// Paint, paper, wood, plaster, plastic and cloth all have 0.9 to 0.97 at these wavelengths.
const EMISSIVITY_OF_WALLS: f64 = 0.95;
