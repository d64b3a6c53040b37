//! The socket: an accept loop of our own, because `axum::serve` waits for slow peers without end.

mod collector;
mod config;
mod error;
mod serving;
mod stall;
mod tls;

pub use collector::Collector;
pub use config::{Config, runtime};
pub use error::CollectorError;
pub use tls::{Certificates, Tls, pin_of_file};
