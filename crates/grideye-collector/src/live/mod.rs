//! What comes from the sensors now, and who is told of it.

mod by_sensor;
mod event;
mod faults;
mod feed;
mod newest;
mod recent;
mod senders;
mod sensor;
mod view;

pub(crate) use event::Event;
pub(crate) use faults::RECENT_WITHIN;
pub(crate) use feed::Live;
pub use newest::{NewestFrame, NewestFrames};
pub use recent::RecentFrames;
pub(crate) use view::stream_json;
