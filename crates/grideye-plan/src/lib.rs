//! Questions put to scenes, beyond what a sensor measures of them: where to put sensors, what several see together, and
//! what a room looks like on paper.
//!
//! ```text
//!                      ┌─▶ coverage     how well each pose sees a person at every place, and the best few poses
//!  grideye_scene::Scene├─▶ fusion       several sensors as one of more pixels (PeerJ CS 11:e3124, "Scenario A")
//!                      ├─▶ separation   which situations sensors tell apart above their noise (the same, "Scenario B")
//!                      ├─▶ drawing      the view of the environment (the same, Figures 3, 11, 12, 14, 24)
//!                      └─▶ ground       outlines from straight above
//! ```
//!
//! Like [`grideye_scene`] it opens no file, reads no clock and owns no randomness: what was found is handed out as text,
//! JSON, CSV or SVG.

pub mod coverage;
pub mod drawing;
pub mod fusion;
pub mod ground;
pub mod separation;
