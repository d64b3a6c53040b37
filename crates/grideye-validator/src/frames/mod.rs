//! The frames of a comparison: types, faults, cleaning, noise, common drift, thinning.

pub(crate) mod cleaning;
pub(crate) mod drift;
pub(crate) mod faults;
pub(crate) mod fitted;
pub(crate) mod noise;
mod thinning;
pub(crate) mod timeline;
pub(crate) mod types;

pub use cleaning::{LeftOut, LeftOutCount};
pub use thinning::{RECORDS_MAX, RUN_RECORDS, Thinned, Thinning};
pub use timeline::{Apart, Joined, Timeline};
pub use types::{Protocol, RealFrame, RoomSource, SimulatedFrame, sensor_step_c};
