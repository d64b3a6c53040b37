//! The whole agent: one thread per bus, one for uploads, one for the spool, and the account of their work.

mod handle;
mod start;
mod threads;

pub use handle::{
    AgentHandle, BUS_STOP_MAX, SPOOLER_STOP_MAX, SensorSummary, Summary, UPLOAD_STOP_MAX,
};
pub use start::{Agent, Start, StartError};
pub use threads::AnyBus;
