//! The agent as a whole: a thread for each bus, one for the uploads, one for the spool, and the account of what they did.

mod bus_thread;
mod error;
mod handle;
mod start;
mod summary;
mod threads;

pub use bus_thread::AnyBus;
pub use error::StartError;
pub use handle::{AgentHandle, BUS_STOP_MAX, SPOOLER_STOP_MAX, UPLOAD_STOP_MAX};
pub use start::{Agent, Start};
pub use summary::{SensorSummary, Summary};
