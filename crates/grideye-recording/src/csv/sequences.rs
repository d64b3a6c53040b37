//! Whether a row may follow those before it.

use crate::error::RecordingError;
use crate::record::{Row, StreamId};
use std::collections::BTreeMap;

/// The most streams (device, sensor and boot) that one recording may hold.
pub const STREAMS_MAX: usize = 4096;

/// The last sequence number of each stream.
#[derive(Debug, Default)]
pub(super) struct Sequences(BTreeMap<StreamId, u64>);

impl Sequences {
    /// Whether a row may follow those before it.
    pub(super) fn admit(&mut self, line: u64, row: &Row) -> Result<(), RecordingError> {
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
