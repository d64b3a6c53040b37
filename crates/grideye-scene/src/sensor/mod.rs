//! What a sensor makes of a picture: noise, the faults of one unit, steps.

mod noise;
mod unit;

pub(crate) use noise::add_noise;
pub use noise::fnv1a;
pub(crate) use unit::{measure, quantize};
