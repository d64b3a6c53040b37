//! The sensors' current state, and the events about it.

mod by_sensor;
mod faults;
mod feed;
mod people;
mod recent;
mod senders;
mod sensor;

pub(crate) use faults::RECENT_WITHIN;
pub(crate) use feed::{Event, Live};
pub use feed::{NewestFrame, NewestFrames};
pub use people::{Counting, People};
pub use recent::RecentFrames;
pub(crate) use sensor::stream_json;
