//! Recordings: start, stop, note, list, their frames, and labels on them.

mod csv;
mod download;
mod fields;
mod frames;
pub(crate) mod labels;
pub(crate) mod manage;

pub use fields::attachment;
