//! What the agent is told to do: `agent.toml`.
//!
//! A key that is unknown, misspelt or out of range stops the program: an agent that runs with a silent default loses
//! an afternoon of somebody's recording.

mod bus;
mod error;
mod guarantee;
mod parse;
mod place;
mod spool;
mod types;

pub use error::{CONFIG_BYTES_MAX, ConfigError};
pub use guarantee::Guarantee;
pub use parse::BUSES_MAX;
pub use types::{
    BACKLOG_PER_S_DEFAULT, Body, BusConfig, Config, RING_FRAMES_DEFAULT, SPOOL_AFTER_DEFAULT,
    SensorConfig, SpoolConfig, SpoolMode,
};
