//! The bus: opening it, the thread that reads its sensors, and the watchdog of that thread.

mod open;
mod sensor;
mod watchdog;
mod worker;

pub use open::{LinuxBus, LinuxError, LinuxI2c, OpenBus, OpenError, by_kind};
pub use sensor::Sink;
pub(crate) use sensor::{Delay, Sensor, reason, settings};
pub use watchdog::HUNG_AFTER;
pub(crate) use watchdog::Watched;
pub(crate) use worker::Worker;
pub use worker::read_bus;
