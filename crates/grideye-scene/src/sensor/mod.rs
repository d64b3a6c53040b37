//! What a sensor makes of a picture: noise, the faults of one unit, steps.

mod noise;

pub use noise::fnv1a;
pub(crate) use noise::{add_noise, measure, quantize};
