//! Errors and warnings about a scene.

use grideye_text::{Place, Refusal};
use std::io;

/// Why a scene was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A value in a file is not allowed, or an agent cannot be where it leads.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// A file named by the scene cannot be read.
    #[error("{why}")]
    FileUnreadable {
        /// The key that names it.
        why: Refusal,
        /// The reason.
        source: io::Error,
    },
    /// A sensor's profile is invalid.
    #[error("{place}: the sensor's profile was refused: {source}")]
    Profile {
        /// The key that names it.
        place: Place,
        /// What is wrong with it, and where.
        source: Refusal,
    },
    /// The scene has no such sensor.
    #[error("no sensor `{name}` in this scene\nhint: {}", known_names(known))]
    UnknownSensor {
        /// The requested name.
        name: String,
        /// The known names.
        known: Vec<String>,
    },
}

impl SceneError {
    /// Where the mistake is; `None` for an unknown sensor.
    #[must_use]
    pub const fn place(&self) -> Option<&Place> {
        match self {
            Self::Refused(why) | Self::FileUnreadable { why, .. } => Some(&why.place),
            Self::Profile { place, .. } => Some(place),
            Self::UnknownSensor { .. } => None,
        }
    }
}

fn known_names(known: &[String]) -> String {
    if known.is_empty() {
        return "it has none; add a [[sensor]] table".to_owned();
    }
    format!("choose one of {}", known.join(", "))
}

/// Something to check in an accepted scene.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// The object reaches outside the room and was removed, as in the paper ("Object placement").
    #[error("{why}")]
    ObjectOutsideRoom {
        /// Its name.
        name: String,
        /// How far it reaches.
        why: Refusal,
    },
    /// An agent collides with an object or another agent; only their first contact is reported.
    #[error("{why}")]
    Collision {
        /// The agent, and the object or the other agent.
        names: [String; 2],
        /// When and where.
        why: Refusal,
    },
    /// In the physical model, an agent is as warm as skin and the file does not mention clothes.
    #[error("{0}")]
    WarmAsSkin(Refusal),
}

impl Warning {
    /// The place it refers to.
    #[must_use]
    pub const fn place(&self) -> &Place {
        match self {
            Self::ObjectOutsideRoom { why, .. }
            | Self::Collision { why, .. }
            | Self::WarmAsSkin(why) => &why.place,
        }
    }
}
