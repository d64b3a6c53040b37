//! The measures of likeness between two frames of equal size, at any resolution, in degrees Celsius.
//!
//! Every function answers `None` where the measure is not defined: frames that are empty, of unequal length or that
//! hold a value that is not finite; a correlation with a frame that has one value only; a bin width that is not
//! above zero. No answer is ever NaN. The glossary in this crate's README lists each with its unit and source.

pub(crate) mod binning;
pub(crate) mod blob;
pub(crate) mod chi_squared;
pub(crate) mod counting;
pub(crate) mod distance;
pub(crate) mod foreground;
pub(crate) mod gain;
mod information;
pub(crate) mod pair;
pub(crate) mod score;
pub(crate) mod structure;
pub(crate) mod unclaimed;

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

#[cfg(test)]
mod tests;
