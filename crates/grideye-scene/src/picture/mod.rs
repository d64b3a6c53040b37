//! Renders what a sensor sees: on the paper's sampling grid, without one, or by radiance.

mod area;
mod grid;
mod image;
pub mod physical;
mod projection;
mod resample;

pub(crate) use area::{Facet, ImagePlane, StaticFacets};
pub(crate) use grid::{Accumulator, Backdrop, NOBODY, ShadedPatch};
pub use image::{Filled, Image, Mask};
pub(crate) use physical::{Physical, Shown};
pub(crate) use projection::{SamplingGrid, Sight};
pub(crate) use resample::Resampler;
