//! Two sequences of frames side by side: scores, floors, ceilings, drawn units and the verdict.

mod bootstrap;
mod checks;
mod comparison;
mod floors;
mod pairs;
mod prepared;
pub(crate) mod scoring;
pub(crate) mod settings;
mod shuffle;
mod sums;
mod timeline;

pub use comparison::{Comparison, EvaluationGraph, FilmFrame};
pub use scoring::compare;
pub use settings::{
    FILM_FRAMES_MAX, FRAMES_MAX, NOISE_IMAGES, PLACED_PAIRS_MAX, SHUFFLED_PAIRS_MAX, SHUFFLES_MAX,
    Settings, THREADS_MAX,
};
pub use timeline::{FrameScores, PixelMaps};
