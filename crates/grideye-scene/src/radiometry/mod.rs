//! How a surface appears to a sensor: the paper's formula, and radiance.

pub mod perceived;
mod radiance;

pub(crate) use perceived::{ABSOLUTE_ZERO_C, Air, Glow, Law, Surface};
pub(crate) use radiance::Light;
pub use radiance::{Band, apparent_celsius};
