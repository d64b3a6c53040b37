//! The program on the Raspberry Pi: reads AMG8833 sensors over I2C and delivers every frame to a collector, once.
//!
//! ```text
//!   /dev/i2c-1 ── bus thread ──┐
//!   (0x68, 0x69)  sampler a    │  records   ┌──────┐  batches   ┌──────────┐  POST /v1/frames
//!                 sampler b    ├──────────▶ │ ring │ ─────────▶ │ uploader │ ────────────────▶ collector
//!   /dev/i2c-3 ── bus thread ──┘            └──────┘ ◀───────── └──────────┘ ◀────────────────
//!                 sampler c                 bounded   durable                 durable_through
//!                                             │  ▲
//!                                     spooler ▼  │ backlog
//!                                           ┌───────┐
//!                                           │ spool │ segments on a disk: what waits too long, or everything
//!                                           └───────┘
//! ```
//!
//! Each folder is a floor, and imports go down only. From the bottom:
//!
//! * [`limits`], [`advice`] (what to do about a failure), [`output`] (standard output and standard error, also of `grideye`),
//!   [`log`] and [`clock`] serve all the others.
//! * [`join`] introduces the agent to its collector; [`config`] holds its settings.
//! * [`sampler`] follows the sensor's own clock and counts its frames: none is recorded twice, and each missed one is a
//!   record.
//! * [`bus`] reads the sensors of a bus on a thread of its own, with a watchdog; [`bus::LinuxBus`] is `/dev/i2c-N`.
//! * [`batch`] is one post. [`spool`] stores on a disk what waits too long. [`queue`] stores records in memory and
//!   keeps the account: read = acknowledged + dropped + spooled. [`deliver`] decides what to send when, posts it, and
//!   fills the spool.
//! * [`health`] reports the agent's state to supervisors, [`check`] is the self-test, [`agent`] puts everything
//!   together.
//! * [`cli`] is the program's command line, for its parser and its documentation.
//!
//! Callers hand in the [`clock::Clock`]: the program the system's, tests an emulated one.
//!
//! ```
//! use grideye_agent::config::Config;
//!
//! let config = Config::parse(
//!     r#"
//!     device = "pi-1"
//!     collector = "http://192.168.1.20:8833"
//!
//!     [[bus]]
//!     path = "/dev/i2c-1"
//!     [[bus.sensor]]
//!     address = 0x69
//!     "#,
//!     "agent.toml",
//! )?;
//! assert_eq!(config.buses[0].sensor_id(&config.buses[0].sensors[0]), "i2c-1:0x69");
//!
//! // A misspelt key stops the program, and the message names its line and column.
//! let error = Config::parse("colector = \"http://192.168.1.20:8833\"", "agent.toml").unwrap_err();
//! assert!(error.to_string().starts_with("agent.toml:1:1: unknown field `colector`"));
//! # Ok::<(), grideye_agent::config::ConfigError>(())
//! ```

pub mod advice;
pub mod agent;
pub mod batch;
pub mod bus;
pub mod check;
pub mod cli;
pub mod clock;
pub mod config;
pub mod deliver;
pub mod health;
pub mod join;
pub mod limits;
mod lock;
pub mod log;
pub mod output;
pub mod queue;
mod ranges;
pub mod sampler;
pub mod spool;
