//! Measures the sensor from a recording: rate, steps, noise, common mode, pattern, faults, thermistor, people in view.
//!
//! ```text
//!  records ──▶ Characterizer ──┬─ times     rate, stalls, gaps, jumps of the clock
//!   of one      (constant      ├─ words     steps, torn frames, duplicates, glitches
//!   stream       memory)       ├─ pairs     noise of each pixel, without people walking through
//!                              ├─ segments  common mode, its five-frame cycle, pattern, Allan deviation, people in view
//!                              └─▶ Characterization ──▶ text · page · JSON · a sensor profile for simulator and emulator
//! ```
//!
//! Noise is a Gaussian fitted to the middle of the differences between consecutive frames, because people make the
//! tails. The common mode is the mean of the middle three quarters of the pixels, which a person does not reach.
//!
//! ```
//! use grideye_frame::{PixelWord, RecordedFrame, Reading, ThermistorWord};
//! use grideye_recording::{ClockState, Record, Stamp};
//! use grideye_validator::characterize::characterize;
//!
//! let record = |seq: u64| Record {
//!     seq,
//!     stamp: Stamp { t_boot_ns: seq * 100_000_000, t_utc_ns: 0, clock: ClockState::Unsynced },
//!     reading: Reading::Frame(RecordedFrame {
//!         thermistor: Some(ThermistorWord(400)),
//!         pixels: std::array::from_fn(|pixel| PixelWord(if (seq as usize + pixel) % 3 == 0 { 80 } else { 82 })),
//!     }),
//! };
//! let found = characterize((0..200).map(record))?;
//! assert_eq!(found.steps.pixel_c, Some(0.5));
//! assert!((found.timing.rate_hz - 10.0).abs() < 1e-9);
//! # Ok::<(), grideye_validator::characterize::CharacterizeError>(())
//! ```

mod allan;
pub(crate) mod characterization;
pub(crate) mod common_mode;
pub(crate) mod presence;
pub(crate) mod segment;
pub(crate) mod summary;
mod thermistor;
mod timing;

pub use crate::constants::TORN_RUN_MIN;
pub use crate::frames::faults::Faults;
pub use crate::metrics::room_difference::Spot;
pub use allan::AllanPoint;
pub use characterization::{
    Characterization, CharacterizeError, Characterizer, FRAMES_MIN, NoiseMap, characterize,
};
pub use common_mode::{CommonMode, Cycle, Flicker};
pub use presence::Presence;
pub use segment::Pattern;
pub use summary::Line;
pub use thermistor::{Steps, Thermistor};
pub use timing::{JUMPS_LISTED_MAX, Jump, Timing};
