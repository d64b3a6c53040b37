//! Types that a store takes and returns.

use crate::store::account;
use crate::store::error::{RecordingId, Result, StoreError};
use crate::store::row::damaged;
use grideye_recording::wire::{Account, Acknowledgement, Gap, WireError};
use grideye_recording::{Record, StreamId};
use serde::{Deserialize, Serialize};
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

/// A future with a store's answer.
pub type Answer<'a, T> = Pin<Box<dyn Future<Output = Result<T>> + Send + 'a>>;

/// The space that a store takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StoreUsage {
    /// Bytes used now, without the log.
    pub bytes: u64,
    /// Maximum bytes; `None` if only the disk limits it.
    pub bytes_max: Option<u64>,
    /// Frames that this collector deleted because of their age.
    pub deleted_by_age: u64,
    /// Frames that this collector deleted because the store was too large.
    pub deleted_by_size: u64,
    /// Frames that would be deleted too, if no recording held them.
    pub held: u64,
    /// Recordings.
    pub recordings: u64,
    /// Streams (device, sensor, boot).
    pub streams: u64,
}

/// The result of storing a batch.
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
        let durable_through = streams
            .clone()
            .filter_map(|stream| Some((stream.id.sensor.clone(), stream.durable_through?)));
        Acknowledgement {
            durable_through: durable_through.collect(),
            gaps: streams.flat_map(|stream| &stream.gaps).cloned().collect(),
        }
        .to_json()
    }
}

/// The result for one sensor's part of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SensorAppended {
    /// The stream as it is now.
    pub stream: StreamSummary,
    /// The new sequence numbers, ascending; the others were stored before.
    pub fresh: Vec<u64>,
    /// Whether the stream is new.
    pub is_new: bool,
}

/// Counts and state of one stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StreamSummary {
    /// Device, sensor and boot.
    pub id: Arc<StreamId>,
    /// Stored frames with pixels.
    pub stored: u64,
    /// How many of the frames in `stored` were deleted for age or space.
    pub expired: u64,
    /// Stored rows that say why a frame is missing.
    pub missing: u64,
    /// The highest stored sequence number.
    pub durable_through: Option<u64>,
    /// Runs of lower numbers that never came, ascending; at most the newest `gaps_listed_max`.
    pub gaps: Vec<Gap>,
    /// How many lower numbers never came, including gaps not listed.
    pub never_came: u64,
    /// The agent's last reported account.
    pub account: Option<Account>,
    /// Frames that came with or after that account: the agent counted them as spooled.
    pub came_since_account: u64,
    /// Wall clock of the collector when the stream was last added to, in nanoseconds since 1970-01-01 UTC.
    pub t_last_arrival_ns: i64,
}

impl StreamSummary {
    /// Frames the agent holds now: its spooled count minus those that came since; `None` without an account.
    #[must_use]
    pub fn spooled(&self) -> Option<u64> {
        let account = self.account.as_ref()?;
        Some(account.spooled.saturating_sub(self.came_since_account))
    }

    /// Frames the agent dropped, over all reasons; `None` without an account.
    #[must_use]
    pub fn dropped(&self) -> Option<u64> {
        self.account.as_ref().map(account::dropped)
    }

    /// read - stored - dropped - spooled: 0 when the counts balance, `None` without an account. Above 0, frames are
    /// nowhere; below 0, the acknowledgment of their arrival was lost, and the next account corrects it.
    #[must_use]
    pub fn unaccounted(&self) -> Option<i128> {
        let account = self.account.as_ref()?;
        let elsewhere =
            i128::from(self.stored) + i128::from(self.dropped()?) + i128::from(self.spooled()?);
        Some(i128::from(account.read) - elsewhere)
    }
}

/// A record with its stream and arrival time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredRecord {
    /// Device, sensor and boot.
    pub stream: Arc<StreamId>,
    /// The record.
    pub record: Record,
    /// Wall clock of the collector when it arrived, in nanoseconds since 1970-01-01 UTC.
    pub t_arrival_ns: i64,
}

/// What another collector did in the same store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum News {
    /// It stored frames of one stream.
    Frames(Box<Elsewhere>),
    /// It started or stopped a recording.
    Recordings,
}

/// Frames that another collector stored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Elsewhere {
    /// The stream as it is now.
    pub stream: StreamSummary,
    /// The agent's boot clock when it last sent.
    pub t_sent_boot_ns: Option<u64>,
    /// The newest of these frames, ascending.
    pub records: Vec<StoredRecord>,
}

/// A recording: the frames that arrived between its start and its stop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// Its number.
    pub id: RecordingId,
    /// Its unique name.
    pub name: String,
    /// A note about it; empty without one.
    pub note: String,
    /// Wall clock of the collector at the start, in nanoseconds since 1970-01-01 UTC.
    pub t_start_ns: i64,
    /// Wall clock at the stop; `None` while it runs.
    pub t_stop_ns: Option<i64>,
    /// Frames with pixels so far.
    pub frames: u64,
    /// Rows so far that say why a frame is missing.
    pub missing: u64,
    /// Sensors so far.
    pub sensors: u64,
}

/// The frames of a recording: one span per stream, ordered by device, sensor, boot.
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
    /// Device, sensor and boot.
    pub stream: Arc<StreamId>,
    /// The store's own key of the stream.
    pub(crate) stream_key: i64,
    /// The range of numbers that contains the members.
    pub(crate) seq: (i64, i64),
    /// The members' epochs are above the first value and at most the second.
    pub(crate) epochs: (i64, i64),
}

impl Span {
    /// The lowest and the highest number of its frames.
    #[must_use]
    pub fn seqs(&self) -> (u64, u64) {
        let number = |seq: i64| u64::try_from(seq).unwrap_or(0);
        (number(self.seq.0), number(self.seq.1))
    }

    /// The first number after `after`, or of all; `None` if there can be none.
    pub(crate) fn first_after(&self, after: Option<u64>) -> Option<i64> {
        match after {
            None => Some(self.seq.0),
            Some(seq) => i64::try_from(seq).ok()?.checked_add(1),
        }
    }
}

grideye_frame::named! {
    /// The stage of copying a store, with its name for the progress bar.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Stage {
        /// Frames are copied.
        Copying = "copying";
        /// The copy is compared with the original.
        Comparing = "comparing";
    }
}

/// A label on some of a recording's frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label {
    /// A few words, for example `two people`. Several labels may have the same name.
    pub name: String,
    /// The labeled frames, at least one range.
    pub spans: Vec<LabelSpan>,
}

/// Frames of one stream by their numbers, so that clock changes never move a label.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelSpan {
    /// The agent's name.
    pub device: String,
    /// The sensor.
    pub sensor: String,
    /// The boot.
    pub boot: String,
    /// The first frame.
    pub first_seq: u64,
    /// The last frame, no earlier than the first.
    pub last_seq: u64,
}

/// A stored label.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct KeptLabel {
    /// Its number within the recording, from 1, in the order of addition.
    pub number: i64,
    /// Name and frames.
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
