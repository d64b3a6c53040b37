//! The CSV recording format (`recordings/README.md`): one row per sensor frame; a missing frame is a row with a reason.
//!
//! Reads and writes row by row: memory grows only with the number of streams, at most [`STREAMS_MAX`]. A row without
//! its newline is never used: `26` at the end of a cut file may have been `26.25`.

mod columns;
mod reader;
mod writer;

pub use columns::{COLUMNS, LABELS_MAX, STREAMS_MAX, header, label};
pub use reader::Reader;
pub use writer::Writer;
