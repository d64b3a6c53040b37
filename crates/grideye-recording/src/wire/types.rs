//! What goes over the wire, and how much of it one body may hold.

use crate::record::Record;
use crate::wire::encode;
use crate::wire::values::Integer;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;

/// The content type of a body in JSON.
pub const JSON_TYPE: &str = "application/json";

/// The content type of a body in bytes.
pub const BINARY_TYPE: &str = "application/vnd.grideye.frames.v2";

/// What an agent posts: the records of all its sensors since the last post.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Batch {
    /// The agent's name.
    pub device: String,
    /// The run of the agent.
    pub boot: String,
    /// The agent's `CLOCK_BOOTTIME` when it sent this, in nanoseconds; tells the age of each frame without wall clocks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub t_sent_boot_ns: Option<u64>,
    /// The records, by sensor.
    pub sensors: Vec<SensorBatch>,
}

/// The records of one sensor within a batch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensorBatch {
    /// The sensor's place on the device.
    pub sensor: String,
    /// The agent's own count, so that read = stored + dropped + spooled can be audited at any moment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub account: Option<Account>,
    /// Records in ascending `seq`.
    #[serde(serialize_with = "encode::frames")]
    pub frames: Vec<Record>,
}

/// An agent's count of one stream, from its start.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Account {
    /// Sensor frames read from the bus.
    pub read: u64,
    /// Sensor frames known to have been missed, each sent as a row with its reason.
    pub missing: u64,
    /// Frames read, then dropped before they were stored, by reason.
    pub dropped: BTreeMap<String, u64>,
    /// Frames read and not yet acknowledged: those of this batch included.
    pub spooled: u64,
    /// Faults seen on the bus, by kind (the names of `NoData`, and others that cost no frame).
    pub errors: BTreeMap<String, u64>,
    /// The run is over: what is neither in `spooled` nor stored by now is lost ([`LOST_IN_MEMORY`]). Left out unless true.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ended: bool,
}

/// The reason under which frames are dropped that were in the memory of a run which was killed.
pub const LOST_IN_MEMORY: &str = "lost-in-memory";

/// The collector's answer, given after commit and sync.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Acknowledgement {
    /// By sensor: every record sent with this `seq` or a lower one is on disk, but for the gaps.
    pub durable_through: BTreeMap<String, u64>,
    /// Sequence numbers below `durable_through` that never came.
    pub gaps: Vec<Gap>,
}

/// A run of sequence numbers that the collector does not have.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gap {
    /// The sensor.
    pub sensor: String,
    /// First missing number.
    #[serde(deserialize_with = "count")]
    pub from: u64,
    /// Last missing number.
    #[serde(deserialize_with = "count")]
    pub to: u64,
}

fn count<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    Integer::deserialize(deserializer).map(|Integer(count)| count)
}

/// How much one body may hold; more is refused while it is read. Its bytes are the receiver's to limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Sensors in a batch, or in `durable_through` of an answer.
    pub sensors: usize,
    /// Frames in a batch, those of all its sensors together.
    pub frames: usize,
    /// Reasons in `dropped`, and in `errors`, of one account.
    pub reasons: usize,
    /// Gaps in an answer.
    pub gaps: usize,
}

/// Default of [`Limits::sensors`]: two on each of the buses of a Raspberry Pi, and a multiplexer's worth beside.
pub const SENSORS_MAX: usize = 32;

/// Default of [`Limits::frames`]: nearly seven minutes of one sensor at 10 frames a second, for catching up.
pub const FRAMES_MAX: usize = 4096;

/// Default of [`Limits::reasons`]: some five times the kinds of faults that there are.
pub const REASONS_MAX: usize = 64;

/// Default of [`Limits::gaps`]: one for each frame of the largest batch.
pub const GAPS_MAX: usize = FRAMES_MAX;

/// The longest that one frame is as this crate writes it, in bytes, with the comma that follows.
pub const FRAME_BYTES_MAX: usize = 533;

impl Default for Limits {
    fn default() -> Self {
        Self {
            sensors: SENSORS_MAX,
            frames: FRAMES_MAX,
            reasons: REASONS_MAX,
            gaps: GAPS_MAX,
        }
    }
}
