#![doc = include_str!("../README.md")]

mod account;
mod allowance;
mod arrays;
mod cell;
mod columns;
mod container;
mod error;
mod frames;
mod import;
mod json;
mod moment;
mod plan;
#[cfg(feature = "xlsx")]
mod sheets;
mod source;
mod tables;
mod text;

pub use account::{Account, Tally};
pub use columns::{Columns, Unit};
pub use error::ImportError;
pub use import::{Import, Options, open};
