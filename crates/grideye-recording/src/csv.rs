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

pub use columns::{COLUMNS, header};
pub use reader::Reader;
pub(crate) use reader::check_header;
pub use writer::Writer;

use crate::{Record, RecordingError, StreamId};
use std::collections::BTreeMap;

/// The most streams (device, sensor and boot) that one recording may hold.
pub const STREAMS_MAX: usize = 4096;

/// One row of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Whose frame.
    pub stream: StreamId,
    /// The frame, or the reason why there is none.
    ///
    /// Of each word only the twelve bits that carry a value survive in this format: see [`Writer::write`].
    pub record: Record,
    /// The collector's wall clock when the frame arrived, in nanoseconds since 1970-01-01 UTC, where it is known.
    pub t_arrival_ns: Option<i64>,
}

/// The last sequence number of each stream.
#[derive(Debug, Default)]
struct Sequences(BTreeMap<StreamId, u64>);

impl Sequences {
    /// Whether a row may follow those before it.
    fn admit(&mut self, line: u64, row: &Row) -> Result<(), RecordingError> {
        let found = row.record.seq;
        if let Some(last) = self.0.get_mut(&row.stream) {
            if found <= *last {
                let StreamId {
                    device,
                    sensor,
                    boot,
                } = &row.stream;
                return Err(RecordingError::NotAscending {
                    line,
                    stream: format!("{device} {sensor} {boot}"),
                    previous: *last,
                    found,
                });
            }
            *last = found;
            return Ok(());
        }
        if self.0.len() == STREAMS_MAX {
            return Err(RecordingError::TooManyStreams {
                line,
                limit: STREAMS_MAX,
            });
        }
        self.0.insert(row.stream.clone(), found);
        Ok(())
    }
}
