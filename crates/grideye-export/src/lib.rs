#![doc = include_str!("../README.md")]

#[cfg(feature = "annex")]
pub mod annex;
mod error;
pub mod film;
pub mod npz;
pub mod parquet;
pub mod recording;
pub mod tiles;

pub use error::ExportError;
