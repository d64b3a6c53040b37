//! What the agent is told to do: `agent.toml`.
//!
//! A key that is unknown, misspelt or out of range stops the program: an agent that runs with a silent default loses
//! an afternoon of somebody's recording.

mod parse;
mod types;

pub use parse::BUSES_MAX;
pub use types::{
    BACKLOG_PER_S_DEFAULT, Body, BusConfig, CONFIG_BYTES_MAX, Config, ConfigError, Guarantee,
    RING_FRAMES_DEFAULT, SPOOL_AFTER_DEFAULT, SensorConfig, SpoolConfig, SpoolMode,
};
