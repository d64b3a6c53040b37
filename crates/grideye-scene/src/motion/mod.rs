//! A walker's position at any time.

mod schedule;
mod trajectory;

pub(crate) use schedule::{Clock, Motion, Schedule};
pub use trajectory::Trajectory;
pub(crate) use trajectory::{Leg, Stay, lengths_m};
