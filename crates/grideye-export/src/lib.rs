#![doc = include_str!("../README.md")]

#[cfg(feature = "annex")]
pub mod annex;
pub mod dataset;
mod error;
pub mod film;
mod npz;
mod parquet;
pub mod recording;
mod records;
pub mod tiles;

pub use error::ExportError;
