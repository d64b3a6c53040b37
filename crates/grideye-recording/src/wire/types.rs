//! The bodies on the wire, and the limits of one body.

use crate::record::Record;
use crate::wire::encode;
use crate::wire::values::Integer;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;

/// Content type of a JSON body.
pub const JSON_TYPE: &str = "application/json";

/// Content type of a compact body.
pub const BINARY_TYPE: &str = "application/vnd.grideye.frames.v2";

/// A post of an agent: the records of all its sensors since the last post.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Batch {
    /// The agent's name.
    pub device: String,
    /// The agent's boot.
    pub boot: String,
    /// The agent's `CLOCK_BOOTTIME` when it sent this, in nanoseconds; gives each frame's age without wall clocks.
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
    /// The agent's own count, so that read = stored + dropped + spooled can be checked at any moment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub account: Option<Account>,
    /// Records in ascending `seq`.
    #[serde(serialize_with = "encode::frames")]
    pub frames: Vec<Record>,
}

/// An agent's count of one stream since its start.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Account {
    /// Sensor frames read from the bus.
    pub read: u64,
    /// Sensor frames known to be missed; each is sent as a record with a reason.
    pub missing: u64,
    /// Frames read, then dropped before they were stored, by reason.
    pub dropped: BTreeMap<String, u64>,
    /// Frames read and not yet acknowledged, including those of this batch.
    pub spooled: u64,
    /// Faults on the bus by kind: the names of `NoData`, and others that cost no frame.
    pub errors: BTreeMap<String, u64>,
    /// The boot is over: a frame that is neither in `spooled` nor stored by now is lost ([`LOST_IN_MEMORY`]). Omitted
    /// unless true.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ended: bool,
}

/// The reason for frames that were in the memory of a killed agent.
pub const LOST_IN_MEMORY: &str = "lost-in-memory";

/// The collector's answer, sent after commit and sync.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Acknowledgement {
    /// By sensor: every record sent with this `seq` or a lower one is on disk, except the gaps.
    pub durable_through: BTreeMap<String, u64>,
    /// Sequence numbers below `durable_through` that never arrived.
    pub gaps: Vec<Gap>,
}

/// A range of sequence numbers that the collector does not have.
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

/// Limits of one body, enforced while reading. The receiver limits its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Sensors in a batch, or in an answer's `durable_through`.
    pub sensors: usize,
    /// Frames in a batch, all sensors together.
    pub frames: usize,
    /// Reasons in `dropped`, and in `errors`, of one account.
    pub reasons: usize,
    /// Gaps in an answer.
    pub gaps: usize,
}

/// Default of [`Limits::sensors`]: two on each bus of a Raspberry Pi, plus a multiplexer.
pub const SENSORS_MAX: usize = 32;

/// Default of [`Limits::frames`]: nearly seven minutes of one sensor at 10 Hz, for catching up.
pub const FRAMES_MAX: usize = 4096;

/// Default of [`Limits::reasons`]: about five times the existing kinds of faults.
pub const REASONS_MAX: usize = 64;

/// Default of [`Limits::gaps`]: one per frame of the largest batch.
pub const GAPS_MAX: usize = FRAMES_MAX;

/// Maximum JSON size of one frame as written here, in bytes, including the comma after it.
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
