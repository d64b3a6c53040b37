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
//! * [`limits`], [`advice`] (what to do about a failure), [`log`] and [`clock`] are what all the others use.
//! * [`join`]: how the agent comes to know its collector. [`config`]: what it is told to do.
//! * [`sampler`] follows the sensor's own clock and counts its frames: none is recorded twice, and a missed one is a row.
//! * [`bus`] reads the sensors of a bus on a thread of its own, with a watchdog; [`bus::LinuxBus`] is `/dev/i2c-N`.
//! * [`batch`] is one post; [`spool`] stores on a disk what waits too long; [`queue`] is what waits in memory, with the
//!   account: read = acknowledged + dropped + spooled; [`deliver`] decides what goes when, posts it, and fills the spool.
//! * [`health`] tells supervisors how that goes, [`check`] is the self-test, [`agent`] puts everything together.
//! * [`cli`] is the command line of the program, for whoever parses it and for whoever documents it.
//!
//! Time comes from a [`clock::Clock`] that is handed in: the system's in the program, an emulated one in tests.
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
//! // A misspelt key stops the program, and the message says where.
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
pub mod queue;
pub mod sampler;
pub mod spool;
