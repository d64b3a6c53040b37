#![doc = include_str!("../README.md")]

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
