//! The bus: how it is opened, the thread that reads its sensors, and the watchdog beside that thread.

mod driver;
mod errno;
mod linux;
mod open;
mod sensor;
mod watchdog;
mod worker;

pub(crate) use driver::{Delay, reason, settings};
pub use errno::by_errno;
pub use linux::{LinuxBus, LinuxError, LinuxI2c};
pub use open::{OpenBus, OpenError, by_kind};
pub(crate) use sensor::Sensor;
pub use sensor::Sink;
pub use watchdog::HUNG_AFTER;
pub(crate) use watchdog::Watched;
pub(crate) use worker::Worker;
pub use worker::read_bus;
