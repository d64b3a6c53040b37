//! Scores how alike a real and a simulated recording are, and shows what each score is worth.
//!
//! ```text
//!            floor                     asked    value          verdict: agrees | disagrees | cannot tell
//!   blank frame, shuffled pixels, noise ──┤       │
//!   drawn units that see nothing, or nobody ░░░░  │
//!   drawn units that see what is claimed     │  ▒▒◆▒▒▒▒
//!                                         0 skill 0.6  1
//! ```
//!
//! A blank image scores an image similarity of 85 to 99 %, and shuffling 64 pixels hardly changes mutual information.
//! So each score comes with what chance scores and what the sensor scores against itself. The verdict rests on C and
//! the gain over the blank frame, with and without the empty room. Units drawn from what is known of the recording's
//! unit show what a right scene would score. The other measures are only reported.
//!
//! | verdict | when |
//! |---|---|
//! | agrees | every criterion that was asked is met |
//! | disagrees | a criterion fails; the reasons name it, with the numbers |
//! | cannot tell | fewer than two frames, too few that the scene was not fitted to, nothing warm in the recording, a ceiling that does not rise above chance, or a score that a room without the people (or an empty one) would reach too |
//!
//! [`compare()`] takes frames, [`compare_scene`] a recording and a scene; [`report`] writes either result as a page or
//! JSON. [`align`] matches their time and place first. [`characterize`](mod@characterize) measures the sensor itself.
//!
//! ```
//! use grideye_validator::{Protocol, RealFrame, Settings, Shape, SimulatedFrame, Verdict, compare};
//! use std::time::Duration;
//!
//! let shape = Shape { columns: 8, rows: 8 };
//! let mut person = vec![20.0; 64];
//! person[26..=29].fill(23.0);
//! person[34..=37].fill(23.0);
//! let real = vec![RealFrame { time: Duration::ZERO, celsius: person.clone(), later: Some(person.clone()) }; 2];
//! let simulated = vec![SimulatedFrame { time: Duration::ZERO, celsius: person.clone(), noise_free: person, truth: None }; 2];
//!
//! let settings = Settings::new(Protocol::Static, 20.0, 0.5);
//! let comparison = compare(shape, &real, &simulated, &settings)?;
//! assert_eq!(comparison.judgment.verdict, Verdict::Agrees);
//! # Ok::<(), grideye_validator::ValidatorError>(())
//! ```

pub mod align;
pub mod background;
pub mod calibrate;
pub mod characterize;
mod compare;
mod decision;
mod error;
mod expected;
mod frames;
pub mod metrics;
mod names;
mod numbers;
pub mod orient;
pub mod report;
mod scene_comparison;
pub mod thresholds;
mod verdict;

pub use align::{AlignOptions, Alignment, TimeAlignment};
pub use background::fit::BackgroundFit;
pub use compare::{
    Comparison, EvaluationGraph, FILM_FRAMES_MAX, FRAMES_MAX, FilmFrame, FrameScores, NOISE_IMAGES,
    PLACED_PAIRS_MAX, PixelMaps, SHUFFLED_PAIRS_MAX, SHUFFLES_MAX, Settings, THREADS_MAX, compare,
};
pub use error::{Side, ValidatorError};
pub use expected::{DRAWS, ScoreDistribution};
pub use frames::{
    Apart, Joined, LeftOut, LeftOutCount, Protocol, RECORDS_MAX, RUN_RECORDS, RealFrame, Shape,
    SimulatedFrame, Thinned, Thinning, Timeline, sensor_step_c,
};
pub use metrics::foreground::{ForegroundCorrelation, RoomSource};
pub use metrics::score::{Better, Measure, Score, Scores, Shuffled};
pub use report::paper;
pub use scene_comparison::{
    DYNAMIC_FRAMES, KnownUnit, LAG_FRAMES_MAX, Options, STATIC_FRAMES, compare_scene,
};
pub use thresholds::Thresholds;
pub use verdict::{Asked, Criterion, Judgment, Nobody, State, Verdict, WarmPixels};
