//! The CSV recording format: one row a sensor frame, degrees as exact decimals, missing frames as rows with a reason.
//!
//! `recordings/README.md` is its specification.
//!
//! Written and read row by row: memory does not grow with a recording's length, only with the number of its streams,
//! and that is bounded by [`STREAMS_MAX`].
//!
//! A row without the newline at its end is never used, however whole it looks: `26` at the end of a cut file may have
//! been `26.25`. So a file that was cut at any byte gives the rows before the cut and then an error that names the
//! line, or, when it was cut between two rows, ends early by whole rows.

mod columns;
mod reader;
mod writer;

pub use columns::{COLUMNS, STREAMS_MAX, header};
pub use reader::Reader;
pub(crate) use reader::check_header;
pub use writer::Writer;
