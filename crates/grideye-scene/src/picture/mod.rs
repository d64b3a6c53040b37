//! Renders what a sensor sees: by the paper's model, on its sampling grid, or by radiance.

mod area;
mod grid;
mod image;
pub mod physical;
mod resample;
mod subject;

pub(crate) use area::Area;
pub(crate) use grid::Grid;
pub use image::{Filled, Image, Mask};
pub(crate) use physical::{Lines, Physical};
pub(crate) use subject::{Form, NOBODY, SeenFace, Subject};
