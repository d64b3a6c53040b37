//! How one unit of an 8 x 8 sensor differs from a perfect one: its noise, its pattern, its drift, its clock.
//!
//! ```text
//!  scene ──Simulator::image(t)──▶ what is there ──Profile::apply(seed, tick, t)──▶ what the sensor measures ──▶ steps of 0.25 °C
//!          without its noise                      + pattern + warm-up + common mode + noise, glitches            the emulator's
//! ```
//!
//! A profile is a TOML file; `scenes/profiles/README.md` specifies it, and the files beside it are an ideal sensor, one
//! of the datasheet, and one measured on real recordings. A profile brings the whole of the sensor's noise, so it goes
//! on top of [`Simulator::image`](crate::Simulator::image), never of [`noisy`](crate::Simulator::noisy).
//!
//! What is measured is a pure function of (profile, seed, tick, time, scene): the same bytes on every machine, in any
//! order of calls, by the same rules as the simulator's own noise. Clocks, registers and quantization are unknown here:
//! the numbers of the sensor's clock are only handed on.
//!
//! ```
//! use grideye_frame::{Celsius, Frame};
//! use grideye_scene::profile::Profile;
//! use std::time::Duration;
//!
//! let profile = Profile::parse("[noise]\nsigma_c = 0.3\n[thermistor]\noffset_c = 4.5\n", "mine.toml")?;
//! let room = Frame::uniform(Celsius::new(21.0));
//! let measured = profile.apply(7, 0, Duration::ZERO, room);
//! assert_eq!(measured.thermistor.get(), 25.5);
//! assert_ne!(measured.pixels[0], measured.pixels[1]);
//! assert_eq!(measured, profile.apply(7, 0, Duration::ZERO, room));
//! # Ok::<(), grideye_scene::profile::ProfileError>(())
//! ```

mod draw;
mod read;
mod text;
mod types;
mod unit;

pub use types::{
    CYCLE_TICKS, ClockError, CommonMode, FixedPattern, NAME_CHARACTERS_MAX, OCTAVES_MAX, Profile,
    ProfileError, TEXT_BYTES_MAX, Thermistor, WarmUp,
};
