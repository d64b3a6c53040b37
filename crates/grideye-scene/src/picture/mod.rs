//! How a sensor's picture is made of what is in its view: on the paper's sampling grid, without one, or by radiance.

pub(crate) mod area;
pub(crate) mod grid;
pub(crate) mod image;
pub mod physical;
pub(crate) mod projection;
pub mod resample;
