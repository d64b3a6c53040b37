//! The CSV recording format (`recordings/README.md`): one row a sensor frame, missing frames as rows with a reason.
//!
//! Written and read row by row: memory grows only with the number of streams, which [`STREAMS_MAX`] bounds. A row without the
//! newline at its end is never used: `26` at the end of a cut file may have been `26.25`.

mod columns;
mod reader;
mod writer;

pub use columns::{COLUMNS, STREAMS_MAX, header};
pub use reader::Reader;
pub(crate) use reader::check_header;
pub use writer::Writer;
