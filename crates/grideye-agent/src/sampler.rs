//! One sensor frame becomes one record: none twice, none missed without a row that says why.
//!
//! The sensor has no data-ready bit and no frame counter, and its clock is its own (9.57 Hz was measured on a "10 Hz"
//! part). So the sampler learns the moments of update from what it reads:
//!
//! ```text
//!   update n          update n+1                     update n+2
//!   ────┃─────────────────┃─────────────────────────────┃────▶ sensor's clock
//!           ▲        ▲ ▲      ▲                    ▲        ▲
//!         read n   old new  = n+1                 old     new = n+2
//!                  └─┴ the update lies between: the window of the next one is known the better
//! ```
//!
//! * A read within the window of an update tells on which side of it the update was; the window is halved until it is
//!   narrower than 2 ms, and from then on one read a frame, just behind the window, suffices. Now and then one
//!   read just before the window proves that the sensor has not become faster.
//! * A frame is new because its content changed, or, in a scene without noise, because its update has surely
//!   passed. Where a change may be either of two frames, the next read decides before anything is recorded; if the host
//!   is late for that one as well, both are missing, since a frame under a wrong number would be worse.
//! * The count of frames runs with the sensor's period through every fault, so `seq` shows what was missed. After a
//!   set-up, or so long without frames that the bounds are wider than a period, it is an estimate, which
//!   [`COUNT_ESTIMATED`] says.
//! * Nothing is taken from how long a read took but what the bus' clock makes it take at least: a starved host can be
//!   held up at any point of it.
//!
//! The sampler touches no bus and no clock. It says what is due, is told what came of it, and answers with events.

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
pub(crate) use event::{Due, Event, Span, Task};
pub(crate) use machine::Sampler;
