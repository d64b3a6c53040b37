//! The emulated machine: a scene, a recording or one temperature as AMG8833 sensors on emulated buses, with their clock.
//!
//! ```text
//!  scene ─────┐                    ┌─ Source ─▶ one sensor on its bus, in paced time: the agent in this process
//!  recording ─┼─ Shown ─▶ parts ───┤
//!  21.5 °C ───┘    at each Place   └─ Machine ─▶ a rack of buses in real time: /dev/i2c-N, a socket, USB/IP
//! ```
//!
//! Only here do simulator and emulator meet, as a function from time to frame.
//!
//! ```
//! use grideye_rig::{AtEnd, Build, Machine, Planned, Shown, Timebase, Wiring, World, parts};
//! use std::time::Duration;
//!
//! let world = World::new();
//! let ceiling = Planned { name: "ceiling".to_owned(), place: "1:0x69".parse()? };
//! let build = Build { seed: 1, profile: None, clock_error_ppm: None, at_end: AtEnd::Hold };
//! let parts = parts(&Shown::Constant(21.5), &world, vec![ceiling], &build)?;
//! let base = Timebase::new(Duration::from_millis(250), 1.0);
//! let machine = Machine::new(base, &world, parts, &Wiring::default())?;
//! assert_eq!(machine.rack().iter().count(), 1);
//! machine.start();
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The crate must not know HTTP servers or files.

mod clock;
mod error;
mod machine;
mod parts;
mod place;
mod plan;
mod replayed;
mod sensor;
mod show;
mod shown;

pub use clock::{PacedClock, Timebase};
pub use error::RigError;
pub use machine::{Counts, Machine, ON_BEFORE, Observer, SCL_HZ_RANGE, Wiring};
pub use parts::{Build, Part, buses, parts};
pub use place::{Branch, Place, Placed, Planned, address_of, device};
pub use plan::planned;
pub use replayed::Replayed;
pub use sensor::{AgentClock, SELF_HEATING_C, SharedBus, Source, replay_source, scene_source};
pub use show::{AtEnd, Replay, World};
pub use shown::{Recorded, Shown, recorded};
