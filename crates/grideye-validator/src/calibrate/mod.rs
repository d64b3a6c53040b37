//! A scene's unknowns, found from a recording: poses, temperatures, emissivities, angles of view, the recording's start.
//!
//! ```text
//!  scene with [[fit]] tables ──▶ simulator ──┐
//!  recording ─────────────────▶ frames ──────┴─▶ what is left over ──▶ Levenberg and Marquardt, from several starts
//!                                                  │      ▲                         │
//!                                                  ▼      └─ weights ◀─┐            ▼
//!                                  white noise, pattern, common mode ──┘     values, uncertainties, what cannot be told apart
//! ```
//!
//! # What the uncertainty holds
//! What is left over is white noise, each pixel's fixed pattern (and what is wrong with a still scene), and what all pixels do
//! together, correlated in time. Each part is weighted by its own variance, measured on the recording; a profile tells the
//! common mode better. The 95 % interval is Student's t with the degrees of freedom of the parts by their shares (Satterthwaite
//! 1946, Biometrics Bulletin 2:110), widened as far as neighboring frames repeat one another, which a warning says.
//!
//! Not in it: the accuracy of the sensor as a whole (±2.5 °C, AMG88 spec §4-4), and drift slower than the recording. What the
//! recording does not tell apart is named in a warning; an unknown at one of its bounds has no uncertainty.

mod calibration;
mod frames;
mod linear;
mod model;
mod noise;
mod search;
mod solver;
mod types;
mod uncertainty;

pub use calibration::calibrate;
pub use types::{
    CalibrateError, Calibration, Estimate, FRAMES_DEFAULT, FRAMES_MAX, FRAMES_MIN, Options,
    Progress, STARTS_MAX,
};
