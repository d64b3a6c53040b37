//! Scores how alike a real and a simulated recording are, and shows what each score is worth.
//!
//! ```text
//!  scene ──▶ simulated recordings ──┬──▶ is this one of them?        ── no ──▶ disagrees
//!                                   └──▶ could it be something else? ── yes ─▶ cannot tell, else agrees
//!  recording beside simulation ──▶ scores, each with what chance scores and what the sensor scores against itself
//! ```
//!
//! The verdict rests on simulated recordings, drawn from what the scene leaves open (`[[uncertain]]`) and from the unit's
//! noise and pattern, of the scene and of its alternatives. The scores are only reported: a blank image scores an
//! image similarity of 85 to 99 %, and shuffling 64 pixels hardly changes mutual information.
//!
//! | verdict | when |
//! |---|---|
//! | agrees | every criterion that was asked is met |
//! | disagrees | a criterion fails; the reasons name it, with the numbers |
//! | cannot tell | fewer than two frames, too few that the scene was not fitted to, nothing warm in the recording, or something else than the scene explains it too |
//!
//! [`compare_scene`] takes a recording and a scene, [`compare()`] scores frames alone; [`report`] writes a result as a page
//! or JSON. [`align`] matches their time and place first. [`characterize`](mod@characterize) measures the sensor itself.
//!
//! ```
//! use grideye_validator::{Measure, Protocol, RealFrame, Settings, SimulatedFrame, compare};
//! use std::time::Duration;
//!
//! let mut person = [20.0; 64];
//! person[26..=29].fill(23.0);
//! person[34..=37].fill(23.0);
//! let real = vec![RealFrame { time: Duration::ZERO, celsius: person, later: Some(person) }; 2];
//! let simulated = vec![SimulatedFrame { time: Duration::ZERO, celsius: person, noise_free: person }; 2];
//!
//! let settings = Settings::new(Protocol::Static, 20.0, 0.5);
//! let comparison = compare(&real, &simulated, &settings)?;
//! assert!(comparison.score(Measure::Correlation).value > Some(0.99));
//! # Ok::<(), grideye_validator::ValidatorError>(())
//! ```

mod advice;
pub mod align;
pub mod background;
pub mod calibrate;
pub mod characterize;
mod compare;
mod constants;
mod decision;
mod error;
mod frames;
mod linear;
pub mod metrics;
mod names;
mod numbers;
pub mod orient;
pub mod report;
mod scene_comparison;
#[cfg(test)]
mod tests;
pub mod thresholds;
mod verdict;

pub use align::{AlignOptions, Alignment, TimeAlignment};
pub use background::fit::BackgroundFit;
pub use compare::{
    Comparison, EvaluationGraph, FILM_FRAMES_MAX, FRAMES_MAX, FilmFrame, FrameScores, PixelMaps,
    SHUFFLED_PAIRS_MAX, SHUFFLES_MAX, Settings, compare,
};
pub use decision::{Alternatively, Contrast, Decision, Finding, OFFSETS_M};
pub use error::ValidatorError;
pub use frames::{
    Apart, Joined, LeftOut, LeftOutCount, Protocol, RECORDS_MAX, RUN_RECORDS, RealFrame,
    RoomSource, SimulatedFrame, Thinned, Thinning, Timeline, sensor_step_c,
};
pub use metrics::score::{Better, Measure, Score, Scores, Shuffled, Values};
pub use report::paper;
pub use scene_comparison::{
    DYNAMIC_FRAMES, KnownScene, KnownUnit, LAG_FRAMES_MAX, Options, STATIC_FRAMES, compare_scene,
};
pub use thresholds::Thresholds;
pub use verdict::{Criterion, Judgment, State, Verdict};
