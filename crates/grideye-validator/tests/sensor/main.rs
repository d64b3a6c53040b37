//! Tests of what recordings show of sensor and room: real, emulated, and with planted faults.

mod background;
mod calibrate;
mod characterize;
mod judged_apart;
mod lifelike;
mod people;
