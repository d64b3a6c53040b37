//! Finds a scene's unknowns from a recording: poses, temperatures, emissivities, angles of view, the recording's start.
//!
//! ```text
//!  scene with [[uncertain]] ──▶ simulator ──┐
//!  recording ───────────────▶ frames ───────┴─▶ residuals ──▶ Levenberg-Marquardt, from several starts
//!                                                  │   ▲                         │
//!                                                  ▼   └─ weights ◀─┐            ▼
//!                              white noise, pattern, common mode ───┘   values, uncertainties, warnings
//! ```
//!
//! # What the uncertainty includes
//! The residuals are split into white noise, each pixel's fixed pattern (which includes the errors of a static scene)
//! and a common mode of all pixels, correlated in time. Each part is weighted by its variance on the recording; a
//! profile gives the common mode more exactly. The 95 % interval is Student's t with the parts' degrees of freedom,
//! combined after Satterthwaite (1946, Biometrics Bulletin 2:110). If neighboring frames repeat each other, or the scene
//! misses more than noise where its bodies move, it is widened; a warning says so. The normal law of an
//! `[[uncertain]]` number counts as one more measurement.
//!
//! Not included: the sensor's overall accuracy (±2.5 °C, AMG88 spec §4-4), and drift slower than the recording. A
//! warning names unknowns that the recording cannot separate. An unknown at one of its bounds has no uncertainty.

mod calibration;
mod document;
mod frames;
mod model;
mod noise;
mod search;
mod solver;
mod types;
mod uncertainty;

pub use calibration::calibrate;
pub use types::{
    Calibration, Determined, Estimate, FRAMES_DEFAULT, FRAMES_MAX, FRAMES_MIN, Half, Law, Options,
    Progress, STARTS_MAX,
};
