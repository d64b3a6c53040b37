//! Shapes and places in the room, without temperature: each file knows only those below it.

pub(crate) mod angle;
pub(crate) mod collision;
pub mod count;
pub(crate) mod cuboid;
pub(crate) mod distance;
pub(crate) mod mesh;
pub mod polygon;
pub(crate) mod pose;
