//! Effects of the sensor on an image: noise, the errors of one unit, quantization.

mod noise;
mod spill;

pub use noise::fnv1a;
pub(crate) use noise::{add_noise, measure, quantize};
pub(crate) use spill::spilled;
