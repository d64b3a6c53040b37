//! Why a scene is refused, and what deserves a look.

use crate::geometry::MeshError;
use crate::profile::ProfileError;
use crate::text::{Place, Refusal};
use std::io;

/// Why a scene was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// What a file has is not what it may have.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// An agent that sticks out of the room at some point of its way.
    #[error("{why}")]
    AgentLeavesRoom {
        /// The agent.
        name: String,
        /// The row of the trajectory, or the position in the scene file.
        why: Refusal,
    },
    /// An agent whose way leads through a wall that juts into the room.
    #[error("{0}")]
    AgentMeetsWall(Refusal),
    /// An agent that runs into something, in a scene that does not allow it.
    #[error("{0}")]
    Collision(Refusal),
    /// A file that the scene names, and that could not be read.
    #[error("{why}")]
    FileUnreadable {
        /// The key that names it.
        why: Refusal,
        /// What kept it from being read.
        source: io::Error,
    },
    /// Vertices and faces that make no surface.
    #[error("{why}")]
    NoSolid {
        /// The key, or the OBJ file's line.
        why: Refusal,
        /// What is wrong with them.
        source: MeshError,
    },
    /// A sensor's profile that is none.
    #[error("{place}: the sensor's profile was refused: {source}")]
    Profile {
        /// The key that names it.
        place: Place,
        /// What is wrong with it, and where.
        source: Box<ProfileError>,
    },
    /// A sensor that the scene does not have.
    #[error("no sensor `{name}` in this scene\nhint: {}", known_names(known))]
    UnknownSensor {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: Vec<String>,
    },
}

impl SceneError {
    /// Where the fault is; `None` for a sensor that was asked for and is not there.
    #[must_use]
    pub const fn place(&self) -> Option<&Place> {
        match self {
            Self::Refused(why)
            | Self::AgentMeetsWall(why)
            | Self::Collision(why)
            | Self::AgentLeavesRoom { why, .. }
            | Self::FileUnreadable { why, .. }
            | Self::NoSolid { why, .. } => Some(&why.place),
            Self::Profile { place, .. } => Some(place),
            Self::UnknownSensor { .. } => None,
        }
    }

    pub(crate) fn no_solid(place: Place, name: &str, source: MeshError, hint: &str) -> Self {
        let why = place.refused(format!("`{name}` is no solid: {source}"), hint);
        Self::NoSolid { why, source }
    }
}

fn known_names(known: &[String]) -> String {
    if known.is_empty() {
        return "it has none; add a [[sensor]] table".to_owned();
    }
    format!("it has {}", known.join(", "))
}

/// What the reader of a scene should know of, although the scene was accepted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// The object sticks out of the room and was removed, as the paper does ("Object placement").
    #[error("{why}")]
    ObjectOutsideRoom {
        /// Its name.
        name: String,
        /// How far it reaches.
        why: Refusal,
    },
    /// An agent runs into an object or another agent; only their first contact is reported.
    #[error("{why}")]
    Collision {
        /// The agent, and the object or the other agent.
        names: [String; 2],
        /// When and where.
        why: Refusal,
    },
    /// An agent as warm as skin in the physical model, without a word on what it wears.
    #[error("{0}")]
    WarmAsSkin(Refusal),
}

impl Warning {
    /// What it speaks of.
    #[must_use]
    pub const fn place(&self) -> &Place {
        match self {
            Self::ObjectOutsideRoom { why, .. }
            | Self::Collision { why, .. }
            | Self::WarmAsSkin(why) => &why.place,
        }
    }
}
