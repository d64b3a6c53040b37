//! Builds a [`Scene`](crate::Scene) from a scene file: the tables as TOML, one reader for each, and the whole.

mod agent;
mod body;
mod calibrated;
mod clothes;
mod files;
pub mod key;
pub mod keys;
mod mosaic;
mod obj;
mod person;
mod postures;
mod prints;
mod reader;
mod room;
mod scene;
mod sensor;
mod spread;
mod uncertain;
mod vary;
mod waypoints;

pub use files::Files;
