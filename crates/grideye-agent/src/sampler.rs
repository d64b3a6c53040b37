//! Turns each sensor frame into exactly one record; a missed frame becomes a record with a reason.
//!
//! The sensor has no data-ready bit and no frame counter, and its clock is its own (a "10 Hz" part measured 9.57 Hz).
//! So the sampler learns the update times from its reads:
//!
//! ```text
//!   update n          update n+1                     update n+2
//!   ────┃─────────────────┃─────────────────────────────┃────▶ sensor's clock
//!           ▲        ▲ ▲      ▲                    ▲        ▲
//!         read n   old new  = n+1                 old     new = n+2
//!                  └─┴ the update lies between, which narrows the window of the next one
//! ```
//!
//! * A read within the window of an update shows on which side of it the update was, so the window halves. Once it is
//!   narrower than 2 ms, one read per frame, just after the window, is enough. An occasional read just before the
//!   window proves that the sensor has not become faster.
//! * A frame is new if its content changed or, in a scene without noise, if its update has surely passed. If a change
//!   may be either of two frames, the next read decides before anything is recorded. If the host is late for that read
//!   too, both frames are missing, because a frame under a wrong number would be worse.
//! * The count of frames follows the sensor's period through every fault, so `seq` shows what was missed. After a
//!   set-up, or without frames for so long that the bounds are wider than a period, the count is an estimate, reported
//!   as [`COUNT_ESTIMATED`].
//! * The duration of a read proves nothing beyond the minimum set by the bus clock, because a starved host can stall at
//!   any point of it.
//!
//! The sampler touches no bus and no clock: it returns what is due, receives the outcome, and answers with events.

mod content;
mod event;
mod follow;
mod machine;
mod phase;
#[cfg(test)]
mod tests;

pub use event::{
    BUS_HUNG, COUNT_ESTIMATED, FROZEN_FRAMES, GAP_NOT_LISTED, GLITCH_PIXEL, OUT_OF_STEP,
    THERMISTOR_LATE,
};
pub(crate) use event::{Checked, Due, Event, Span, Task};
pub(crate) use machine::Sampler;
