//! From a scene file to a [`Scene`](crate::Scene): the tables as TOML has them, one reader for each, and the whole.

mod agent;
mod body;
mod clothes;
mod document;
mod files;
mod fit;
pub mod key;
mod mosaic;
mod obj;
mod prints;
mod reader;
mod room;
mod rule;
mod scene;
mod sensor;
mod spread;
mod waypoints;

pub use files::Files;
