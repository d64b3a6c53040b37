//! What recordings tell of their sensor and of the room: real ones, emulated ones, and ones with planted faults.

mod background;
mod calibrate;
mod characterize;
mod lifelike;
