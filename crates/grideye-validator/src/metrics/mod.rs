//! Measures of likeness between two frames of equal size, °C; the README has a glossary.
//!
//! A measure is `None` where undefined: frames empty, of unequal length or not finite; C of a constant frame; a bin
//! width of 0 or less.

pub(crate) mod binning;
pub(crate) mod blob;
pub(crate) mod chi_squared;
pub(crate) mod counting;
pub(crate) mod distance;
pub(crate) mod foreground;
pub(crate) mod gain;
mod information;
pub(crate) mod pair;
pub(crate) mod room_difference;
pub(crate) mod score;
pub(crate) mod structure;

pub use binning::{Binning, BinningError};
pub use blob::{Blob, angle_between, overlap, warm};
pub use chi_squared::{ChiSquared, chi_squared, survival};
pub use distance::{
    IS_THRESHOLD, SENSOR_ACCURACY_C, bias, contrast_slope, correlation, evaluation_graph,
    foreground_rmse, image_similarity, mae, rmse, slope,
};
pub use information::{entropy, joint_entropy, mutual_information, mutual_information_corrected};
pub use pair::{PairScores, Scorer, THRESHOLDS, thresholds_c};
pub use structure::{SSIM_RANGE_C, structural_similarity, structure_map};
