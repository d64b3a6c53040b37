//! How one unit of an 8 x 8 sensor differs from a perfect one: its noise, pattern, drift and clock.
//!
//! `scenes/profiles/README.md` specifies the file. A profile includes all of the sensor's noise, so apply it to
//! [`Simulator::image`](crate::Simulator::image), never to [`noisy`](crate::Simulator::noisy). The result is a pure
//! function of (profile, seed, tick, time, scene).
//!
//! ```
//! use grideye_frame::{Celsius, Frame};
//! use grideye_scene::profile::Profile;
//! use std::time::Duration;
//!
//! let profile = Profile::parse("[noise]\nsigma_c = 0.3\n[thermistor]\noffset_c = 4.5\n", "mine.toml")?;
//! let room = Frame::uniform(Celsius::new(21.0));
//! assert_eq!(profile.apply(7, 0, Duration::ZERO, room).thermistor.get(), 25.5);
//! # Ok::<(), grideye_scene::Refusal>(())
//! ```

mod read;
mod types;
mod unit;

pub use read::PROFILE;
pub use types::{
    BUILT_IN, CYCLE_TICKS, ClockError, CommonMode, FixedPattern, NAME_CHARACTERS_MAX, OCTAVES_MAX,
    Profile, TEXT_BYTES_MAX, Thermistor, WarmUp,
};
