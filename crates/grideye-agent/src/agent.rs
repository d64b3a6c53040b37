//! The agent as a whole: a thread for each bus, one for the uploads, one for the spool, and the account of what they did.

mod handle;
mod start;
mod threads;

pub use handle::{
    AgentHandle, BUS_STOP_MAX, SPOOLER_STOP_MAX, SensorSummary, Summary, UPLOAD_STOP_MAX,
};
pub use start::{Agent, Start, StartError};
pub use threads::AnyBus;
