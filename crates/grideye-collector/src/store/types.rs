//! What a store keeps and answers.

use crate::store::account;
use crate::store::error::{RecordingId, Result, StoreError};
use crate::store::row::damaged;
use grideye_recording::wire::{Account, Acknowledgement, Gap, WireError};
use grideye_recording::{Record, StreamId};
use serde::{Deserialize, Serialize};
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

/// The answer of a store, when it comes.
pub type Answer<'a, T> = Pin<Box<dyn Future<Output = Result<T>> + Send + 'a>>;

/// The room that a store takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StoreUsage {
    /// Bytes that it takes now, without a log that is folded in again.
    pub bytes: u64,
    /// Bytes that it may take; `None` where the disk alone is the limit.
    pub bytes_max: Option<u64>,
    /// Frames that this collector deleted because they were too old.
    pub deleted_by_age: u64,
    /// Frames that this collector deleted because the store was too large.
    pub deleted_by_size: u64,
}

/// What became of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Appended {
    /// By sensor, in the batch's order.
    pub sensors: Vec<SensorAppended>,
}

impl Appended {
    /// The answer to the agent, as JSON ([`Acknowledgement`]).
    ///
    /// # Errors
    /// [`WireError`] if it cannot be written.
    pub fn acknowledgement(&self) -> Result<Vec<u8>, WireError> {
        let streams = self.sensors.iter().map(|sensor| &sensor.stream);
        let durable_through = streams.clone().filter_map(|stream| {
            let seq = stream.durable_through?;
            Some((stream.id.sensor.as_str(), seq))
        });
        let gaps = streams.flat_map(|stream| &stream.gaps);
        Acknowledgement::write_json(durable_through, gaps)
    }
}

/// What became of one sensor's part of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SensorAppended {
    /// The stream as it is now.
    pub stream: StreamSummary,
    /// The sequence numbers that were new, in ascending order; the others were there already.
    pub fresh: Vec<u64>,
}

/// What is kept of one stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StreamSummary {
    /// Whose frames.
    pub id: Arc<StreamId>,
    /// Frames kept that carry pixels.
    pub stored: u64,
    /// Of the frames in `stored`, those that were deleted because they were old, or the room was used up.
    pub expired: u64,
    /// Rows kept that say why there is no frame.
    pub missing: u64,
    /// The highest sequence number kept.
    pub durable_through: Option<u64>,
    /// Runs of numbers below it that never came, in ascending order; at most the newest `gaps_listed_max`.
    pub gaps: Vec<Gap>,
    /// How many numbers below it never came, those of gaps not listed included.
    pub never_came: u64,
    /// The agent's own count, as last reported.
    pub account: Option<Account>,
    /// Frames that came with or after that count: the agent still had them in its spool when it made it.
    pub came_since_account: u64,
    /// Wall clock of the collector when the stream was last added to, in nanoseconds since 1970-01-01 UTC.
    pub t_last_arrival_ns: i64,
}

impl StreamSummary {
    /// Frames that the agent holds now: its own count less what came with it and since; `None` without a count.
    #[must_use]
    pub fn spooled(&self) -> Option<u64> {
        let account = self.account.as_ref()?;
        Some(account.spooled.saturating_sub(self.came_since_account))
    }

    /// Frames that the agent gave up, whatever the reason; `None` without a count.
    #[must_use]
    pub fn dropped(&self) -> Option<u64> {
        self.account.as_ref().map(account::dropped)
    }

    /// read - stored - dropped - spooled: 0 when the books balance, `None` without a count. Above 0, frames are nowhere; below 0,
    /// the answer that told of their arrival was lost, and the next count mends that.
    #[must_use]
    pub fn unaccounted(&self) -> Option<i128> {
        let account = self.account.as_ref()?;
        let elsewhere =
            i128::from(self.stored) + i128::from(self.dropped()?) + i128::from(self.spooled()?);
        Some(i128::from(account.read) - elsewhere)
    }
}

/// A record together with whose it is and when it came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredRecord {
    /// Whose.
    pub stream: Arc<StreamId>,
    /// The record.
    pub record: Record,
    /// Wall clock of the collector when it arrived, in nanoseconds since 1970-01-01 UTC.
    pub t_arrival_ns: i64,
}

/// What another collector did in the same store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum News {
    /// It kept frames of one stream.
    Frames(Box<Elsewhere>),
    /// It started or stopped a recording.
    Recordings,
}

/// Frames that another collector kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Elsewhere {
    /// The stream as it is now.
    pub stream: StreamSummary,
    /// The agent's boot clock when it last sent.
    pub t_sent_boot_ns: Option<u64>,
    /// The newest of the frames, in ascending seq.
    pub records: Vec<StoredRecord>,
}

/// A recording: the frames that arrived between its start and its stop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// Its number.
    pub id: RecordingId,
    /// Its name, unlike every other's.
    pub name: String,
    /// What somebody wrote about it; empty if nobody did.
    pub note: String,
    /// Wall clock of the collector at the start, in nanoseconds since 1970-01-01 UTC.
    pub t_start_ns: i64,
    /// The same at the stop; `None` while it runs.
    pub t_stop_ns: Option<i64>,
    /// Frames with pixels in it, until now.
    pub frames: u64,
    /// Rows in it that say why there is no frame, until now.
    pub missing: u64,
    /// Sensors in it, until now.
    pub sensors: u64,
}

/// The frames of a recording, as one span a stream, ordered by device, sensor, boot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Members {
    /// The recording.
    pub recording: Recording,
    /// Its spans.
    pub spans: Vec<Span>,
}

/// The part of one stream that belongs to a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Span {
    /// Whose frames.
    pub stream: Arc<StreamId>,
    /// The store's own number of the stream.
    pub(crate) stream_key: i64,
    /// The range of numbers in which the members are.
    pub(crate) seq: (i64, i64),
    /// The members' epochs are above the first of these, and not above the second.
    pub(crate) epochs: (i64, i64),
}

impl Span {
    /// The lowest and the highest number of its frames.
    #[must_use]
    pub fn seqs(&self) -> (u64, u64) {
        let number = |seq: i64| u64::try_from(seq).unwrap_or(0);
        (number(self.seq.0), number(self.seq.1))
    }

    /// The first number behind `after`, or of all; `None` where there can be none.
    pub(crate) fn first_after(&self, after: Option<u64>) -> Option<i64> {
        match after {
            None => Some(self.seq.0),
            Some(seq) => i64::try_from(seq).ok()?.checked_add(1),
        }
    }
}

/// How far a copy of a store is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Frames are copied.
    Copying,
    /// The copy is compared with the original.
    Comparing,
}

impl Stage {
    /// For the progress bar.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Copying => "copying",
            Self::Comparing => "comparing",
        }
    }
}

/// What is to be seen in some of a recording's frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label {
    /// In a word or a few, for example `two people`. Several labels may say the same.
    pub name: String,
    /// In which frames, at least one range.
    pub spans: Vec<LabelSpan>,
}

/// Frames of one stream, by their numbers: so that a label belongs to the same frames whatever becomes of clocks.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelSpan {
    /// The agent's name.
    pub device: String,
    /// The sensor.
    pub sensor: String,
    /// The run.
    pub boot: String,
    /// The first frame.
    pub first_seq: u64,
    /// The last frame, not before the first.
    pub last_seq: u64,
}

/// A label as the store has it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct KeptLabel {
    /// Its number among those of the recording, from 1, in the order in which they were added.
    pub number: i64,
    /// What it says.
    #[serde(flatten)]
    pub label: Label,
}

impl Label {
    pub(super) fn to_text(&self) -> Result<String> {
        serde_json::to_string(self).map_err(|error| StoreError::Failed(error.to_string()))
    }
}

impl KeptLabel {
    pub(super) fn from_text(number: i64, text: &str) -> Result<Self> {
        let label = serde_json::from_str(text);
        let label = label.map_err(|error| damaged(&format!("label {number}: {error}")))?;
        Ok(Self { number, label })
    }
}
