//! Why a scene is refused, and what deserves a look.

use crate::geometry::mesh::MeshError;
use crate::profile::ProfileError;
use crate::text::place::Place;
use std::fmt;
use std::io;
use std::time::Duration;

/// Why a scene was refused: each names the place, the key, what was found there and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// Not TOML, an unknown key, a missing key, or a value of the wrong type.
    #[error("{place}: {message}\nhint: {hint}")]
    Malformed {
        /// Where.
        place: Place,
        /// What the TOML reader says of it.
        message: String,
        /// What to do.
        hint: &'static str,
    },
    /// A value that a scene cannot have: out of range, not a number, not built.
    #[error("{place}: `{key}` is {found}, expected {expected}\nhint: {hint}")]
    Value {
        /// Where.
        place: Place,
        /// The key, as the file spells it.
        key: &'static str,
        /// The value in the file.
        found: String,
        /// The values there may be.
        expected: String,
        /// What to do.
        hint: &'static str,
    },
    /// A key that this table must have, given its other keys.
    #[error("{place}: {table} has no `{key}`\nhint: {hint}")]
    MissingKey {
        /// The table's place.
        place: Place,
        /// The table, with its name.
        table: String,
        /// The key that is missing.
        key: &'static str,
        /// What to do.
        hint: &'static str,
    },
    /// Two keys of which a table may have only one.
    #[error("{place}: {table} has both `{key}` and `{other}`\nhint: {hint}")]
    KeysConflict {
        /// The table's place.
        place: Place,
        /// The table, with its name.
        table: String,
        /// One key.
        key: &'static str,
        /// The other.
        other: &'static str,
        /// What to do.
        hint: &'static str,
    },
    /// Two things of one name.
    #[error(
        "{place}: the name `{name}` is taken by line {first_line}\nhint: give each {kind} a name of its own"
    )]
    DuplicateName {
        /// The second one's place.
        place: Place,
        /// The name.
        name: String,
        /// Line of the first one.
        first_line: usize,
        /// `sensor`, or `object and agent`.
        kind: &'static str,
    },
    /// More of something than a scene may have.
    #[error("{place}: {found} {what}, expected at most {limit}\nhint: {hint}")]
    TooMany {
        /// Where the first one too many is.
        place: Place,
        /// What there is too much of.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there may be.
        limit: usize,
        /// What to do.
        hint: &'static str,
    },
    /// A sensor that is not in the room.
    #[error(
        "{place}: sensor `{name}` at {found_mm} mm is outside the room of {room_mm} mm\nhint: the room's origin is its bottom-left corner; move the sensor or enlarge the room"
    )]
    SensorOutsideRoom {
        /// Where.
        place: Place,
        /// The sensor.
        name: String,
        /// Its position.
        found_mm: String,
        /// The room's size.
        room_mm: String,
    },
    /// An agent that sticks out of the room at some point of its way.
    #[error(
        "{place}: agent `{name}` leaves the room of {room_mm} mm: its body reaches {reach_mm} mm there\nhint: a position is the middle of the underside; move the way-point or shrink the body"
    )]
    AgentLeavesRoom {
        /// The row of the trajectory, or the position in the scene file.
        place: Place,
        /// The agent.
        name: String,
        /// From the lowest to the highest corner of the body there.
        reach_mm: String,
        /// The room's size.
        room_mm: String,
    },
    /// An agent whose way leads through a wall that juts into the room.
    #[error(
        "{place}: agent `{name}` goes through a wall after {} s, at {place_mm} mm, on its way to this point\nhint: add way-points that lead round the corner, or shrink the body",
        rounded_s(*time)
    )]
    AgentMeetsWall {
        /// The row of the trajectory that it is on its way to, or the position in the scene file.
        place: Place,
        /// The agent.
        name: String,
        /// When it begins.
        time: Duration,
        /// Where it begins.
        place_mm: String,
    },
    /// An agent that runs into something, in a scene that does not allow it.
    #[error("{place}: {}", collision(names, *time, place_mm))]
    Collision {
        /// The agent's name in the file.
        place: Place,
        /// The agent, and the object or the other agent.
        names: [String; 2],
        /// When it begins.
        time: Duration,
        /// Where it begins.
        place_mm: String,
    },
    /// A file that the scene names, and that could not be read.
    #[error(
        "{place}: cannot read the {what} `{path}`: {source}\nhint: the path is taken from the scene file's folder"
    )]
    FileUnreadable {
        /// The key that names it.
        place: Place,
        /// `trajectory`, or `OBJ file`.
        what: &'static str,
        /// The path in the scene.
        path: String,
        /// What kept it from being read.
        source: io::Error,
    },
    /// A row of a trajectory that is no way-point.
    #[error(
        "{place}: found {found}, expected {expected}\nhint: a trajectory has the columns x_mm,y_mm,z_mm and one way-point a row"
    )]
    TrajectoryRow {
        /// The row, and the column of the field in it.
        place: Place,
        /// What is there.
        found: String,
        /// What should be.
        expected: String,
    },
    /// Vertices and faces that make no surface.
    #[error("{place}: `{name}` is no solid: {source}\nhint: {hint}")]
    NoSolid {
        /// The key, or the OBJ file's line.
        place: Place,
        /// The object, or the part of an agent.
        name: String,
        /// What is wrong with them.
        source: MeshError,
        /// What to do.
        hint: &'static str,
    },
    /// A line of an OBJ file that is none.
    #[error(
        "{place}: found {found}, expected {expected}\nhint: of OBJ files, lines `v x y z` and `f a b c` are read, everything else is passed over"
    )]
    ObjLine {
        /// The line.
        place: Place,
        /// What is there.
        found: String,
        /// What should be.
        expected: &'static str,
    },
    /// A sensor's profile that is none.
    #[error("{place}: the sensor's profile was refused: {source}")]
    Profile {
        /// The key that names it.
        place: Place,
        /// What is wrong with it, and where.
        source: Box<ProfileError>,
    },
    /// A sensor that the scene has not.
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
            Self::Malformed { place, .. }
            | Self::Value { place, .. }
            | Self::MissingKey { place, .. }
            | Self::KeysConflict { place, .. }
            | Self::DuplicateName { place, .. }
            | Self::TooMany { place, .. }
            | Self::SensorOutsideRoom { place, .. }
            | Self::AgentLeavesRoom { place, .. }
            | Self::AgentMeetsWall { place, .. }
            | Self::Collision { place, .. }
            | Self::FileUnreadable { place, .. }
            | Self::TrajectoryRow { place, .. }
            | Self::NoSolid { place, .. }
            | Self::ObjLine { place, .. }
            | Self::Profile { place, .. } => Some(place),
            Self::UnknownSensor { .. } => None,
        }
    }
}

fn collision(names: &[String; 2], time: Duration, place_mm: &str) -> String {
    let [agent, other] = names;
    let seconds = rounded_s(time);
    format!(
        "`{agent}` runs into `{other}` after {seconds} s at {place_mm} mm\nhint: move one of them, list `{other}` in the agent's `touches`, or write collisions = \"ignore\" at the top of the scene"
    )
}

fn rounded_s(time: Duration) -> f64 {
    (time.as_secs_f64() * 1000.0).round() / 1000.0
}

fn known_names(known: &[String]) -> String {
    if known.is_empty() {
        return "it has none; add a [[sensor]] table".to_owned();
    }
    format!("it has {}", known.join(", "))
}

/// What the reader of a scene should know of, although the scene was accepted.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The object sticks out of the room and was removed, as the paper does ("Object placement").
    ObjectOutsideRoom {
        /// Where the object is in the file.
        place: Place,
        /// Its name.
        name: String,
        /// From the lowest to the highest corner of the object.
        reach_mm: String,
        /// The room's size.
        room_mm: String,
    },
    /// An agent runs into an object or another agent; it is only said of their first contact.
    Collision {
        /// The agent's name in the file.
        place: Place,
        /// The agent, and the object or the other agent.
        names: [String; 2],
        /// When it begins.
        time: Duration,
        /// Where it begins.
        place_mm: String,
    },
    /// An agent as warm as skin in the physical model, without a word on what it wears.
    WarmAsSkin {
        /// Its temperature in the file.
        place: Place,
        /// Its name.
        name: String,
        /// The temperature, °C.
        celsius: f64,
    },
}

impl Warning {
    /// What it speaks of.
    #[must_use]
    pub const fn place(&self) -> &Place {
        match self {
            Self::ObjectOutsideRoom { place, .. }
            | Self::Collision { place, .. }
            | Self::WarmAsSkin { place, .. } => place,
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ObjectOutsideRoom {
                place,
                name,
                reach_mm,
                room_mm,
            } => write!(
                formatter,
                "{place}: object `{name}` was removed: it reaches {reach_mm} mm, beyond the room of {room_mm} mm\nhint: a position is the middle of the underside; move or shrink the object"
            ),
            Self::Collision {
                place,
                names,
                time,
                place_mm,
            } => write!(formatter, "{place}: {}", collision(names, *time, place_mm)),
            Self::WarmAsSkin {
                place,
                name,
                celsius,
            } => write!(
                formatter,
                "{place}: agent `{name}` shines like a surface of {celsius} °C, and clothed people look like 21 to 24 °C in a room of 20\nhint: write surface = \"clothed\" (or \"skin\", \"hair\", \"coat\"), or the emissivity beside the temperature if it is meant"
            ),
        }
    }
}
