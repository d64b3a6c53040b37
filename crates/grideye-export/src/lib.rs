#![doc = include_str!("../README.md")]

#[cfg(feature = "annex")]
pub mod annex;
pub mod dataset;
mod error;
mod npy;
mod parquet;
pub mod recording;
pub mod tiles;

pub use error::ExportError;
