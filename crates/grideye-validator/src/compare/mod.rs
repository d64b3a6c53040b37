//! Compares two sequences of frames: scores, floors, ceilings and the verdict.

mod comparison;
mod floors;
mod prepared;
pub(crate) mod scoring;
pub(crate) mod settings;
mod sums;

pub use comparison::{Comparison, EvaluationGraph, FilmFrame, FrameScores, PixelMaps};
pub use scoring::compare;
pub use settings::{FILM_FRAMES_MAX, FRAMES_MAX, SHUFFLED_PAIRS_MAX, SHUFFLES_MAX, Settings};
