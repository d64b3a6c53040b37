//! From a scene file to a [`Scene`](crate::Scene): the tables as TOML has them, one reader for each, and the whole.

pub(crate) mod agent;
pub(crate) mod body;
pub(crate) mod clothes;
pub(crate) mod document;
pub(crate) mod files;
pub(crate) mod fit;
pub(crate) mod mosaic;
pub(crate) mod obj;
pub(crate) mod physical;
pub(crate) mod prints;
pub(crate) mod room;
pub(crate) mod rule;
pub(crate) mod scene;
pub(crate) mod sensor;
pub(crate) mod source;
pub(crate) mod spread;
pub(crate) mod waypoints;
