//! Measures of likeness between two frames of equal size, °C; the README has a glossary.
//!
//! A measure is `None` where undefined: frames empty, of unequal length or not finite; C of a constant frame; a bin
//! width of 0 or less.

pub(crate) mod blob;
pub(crate) mod distance;
pub(crate) mod entropy;
pub(crate) mod graph;
pub(crate) mod room_difference;
pub(crate) mod score;
pub(crate) mod surface;

pub use blob::Blob;
pub use distance::{IS_THRESHOLD, SENSOR_ACCURACY_C, bias, correlation, image_similarity, rmse};
pub use graph::{THRESHOLDS, thresholds_c};
