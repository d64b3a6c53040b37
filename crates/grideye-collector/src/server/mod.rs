//! The server: with an accept loop of its own, because `axum::serve` waits for slow peers forever.

mod collector;
mod config;
mod error;
mod serving;
mod tls;

pub use collector::Collector;
pub use config::{Config, runtime};
pub use error::CollectorError;
pub use tls::{Certificates, Tls, pin_of_file};
