//! The collector: receives frames over HTTP, stores them durably, shows them live, and records them.
//!
//! ```text
//!    agents ── POST /v1/frames ──▶ ingest ──▶ FrameStore (SQLite: one writer, one sync for all waiting batches)
//!              ◀─ durable_through ── after commit and sync            │
//!                                    │                                ├──▶ /v1/recordings/{id}.csv
//!                                    ▼                                └──▶ /v1/audit: read = stored + dropped + spooled
//!    browser ◀── / and /v1/live ── current state of every sensor ──▶ /v1/sensors
//! ```
//!
//! ```no_run
//! use grideye_collector::{Collector, Config, StoreLocation, SystemClock};
//! use std::sync::Arc;
//!
//! # async fn run() -> Result<(), grideye_collector::CollectorError> {
//! let listen = ([127, 0, 0, 1], 8080).into();
//! let collector = Collector::bind(Config::new(listen, StoreLocation::Memory, Arc::new(SystemClock::new()))).await?;
//! println!("http://{}/", collector.local_addr());
//! collector.serve(std::future::pending()).await
//! # }
//! ```
//!
//! An acknowledged frame is on disk; storing it again changes nothing; ages come from clocks that do not jump.

mod accounts;
mod alarm;
pub mod auth;
mod clock;
mod connections;
mod counters;
mod http;
mod limits;
mod live;
mod lock;
mod log;
mod openapi;
mod page;
mod peer;
mod percent;
mod rates;
mod router;
mod server;
mod shares;
pub mod store;

pub use accounts::{Account, Accounts, Rivals};
pub use clock::{Clock, SystemClock};
pub use http::{Annex, AppState, Asset, Ingest, Inside, Refusal, attachment, played};
pub use limits::Limits;
pub use live::{Counting, NewestFrame, NewestFrames, People, RecentFrames};
pub use log::{Level, Log, LogEvent};
pub use router::{Routes, app, app_with};
pub use server::{Certificates, Collector, CollectorError, Config, Tls, pin_of_file, runtime};
pub use store::{
    FrameStore, PostgresStore, PostgresUrl, SqliteStore, StoreError, StoreLocation, UrlError,
};
