//! Recordings: start, stop, note, list, frames, and labels.

mod csv;
mod download;
mod fields;
mod frames;
pub(crate) mod labels;
pub(crate) mod manage;

pub use fields::attachment;
pub(crate) use fields::not_written;
pub use frames::played;
