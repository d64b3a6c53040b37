//! A checked scene as plain values: room, bodies, agents, sensors, and what was wrong with a file. Nothing here parses.

pub(crate) mod body;
pub(crate) mod contact;
pub(crate) mod error;
pub mod fit;
pub mod limits;
pub(crate) mod print;
pub(crate) mod room;
pub(crate) mod scene;
pub(crate) mod sensor;
