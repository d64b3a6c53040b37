//! A scene's unknowns, found from a recording: poses, temperatures, emissivities, angles of view, the time at which the
//! recording begins; with an honest uncertainty for each.
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
//! What is left over is taken apart into white noise, what each pixel keeps for the whole recording (its fixed pattern,
//! and what is wrong with the scene where nothing moves), and what all pixels do together (correlated in time). Each
//! part is weighted by its own variance, measured on the recording itself; a profile of the sensor tells the common
//! mode better than ten seconds can. The 95 % interval is that of Student's t with as many degrees of freedom as the
//! parts have, by their shares in the unknown's variance (Satterthwaite 1946, Biometrics Bulletin 2:110). Where the
//! white part is not white, because bodies move otherwise than the scene says, the uncertainty is widened by as much as
//! neighboring frames repeat one another, and a warning says so.
//!
//! What no recording shows is not in it: the accuracy of the sensor as a whole (±2.5 °C, AMG88 spec §4-4), which goes
//! into every temperature, and drift that is slower than the recording.
//!
//! # What is not found
//! Numbers that the recording does not tell apart, such as emissivity and temperature of a body that is seen from one
//! distance, are named in a warning, with their correlation. An unknown at one of its bounds has no uncertainty.

mod calibration;
mod frames;
mod linear;
mod model;
mod noise;
mod search;
mod solver;
mod types;
mod uncertainty;

pub use calibration::{calibrate, calibrate_telling};
pub use types::{
    CalibrateError, Calibration, Estimate, FRAMES_DEFAULT, FRAMES_MAX, FRAMES_MIN, Options,
    Progress, STARTS_MAX,
};
