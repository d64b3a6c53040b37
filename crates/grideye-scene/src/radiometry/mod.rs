//! What a surface looks like to a sensor: the paper's formula, and radiance.

pub mod perceived;
pub(crate) mod radiance;
