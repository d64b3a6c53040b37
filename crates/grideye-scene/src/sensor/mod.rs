//! Effects of the sensor on an image: noise, the errors of one unit, quantization.

mod noise;

pub use noise::fnv1a;
pub(crate) use noise::{add_noise, measure, quantize};
