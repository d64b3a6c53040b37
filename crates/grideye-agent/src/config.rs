//! The agent's settings: `agent.toml`.
//!
//! An unknown, misspelt or out-of-range key stops the program: a silent default could cost an afternoon's recording.

mod parse;
mod types;

pub use parse::{BUSES_MAX, CONFIG};
pub use types::{
    BACKLOG_PER_S_DEFAULT, Body, BusConfig, CONFIG_BYTES_MAX, Config, ConfigError, Guarantee,
    RING_FRAMES_DEFAULT, SPOOL_AFTER_DEFAULT, SensorConfig, SpoolConfig, SpoolMode,
};
