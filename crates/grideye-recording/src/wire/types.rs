//! The bodies on the wire, and the limits of one body.

use crate::record::Record;
use crate::wire::values::{Bounded, Expected, count, counts, list, object, some_count};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Content type of a JSON body.
pub const JSON_TYPE: &str = "application/json";

/// Content type of a compact body.
pub const BINARY_TYPE: &str = "application/vnd.grideye.frames.v2";

/// A post of an agent: the records of all its sensors since the last post.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Batch {
    /// The agent's name.
    pub device: String,
    /// The agent's boot.
    pub boot: String,
    /// The agent's `CLOCK_BOOTTIME` when it sent this, in nanoseconds; gives each frame's age without wall clocks.
    #[serde(
        default,
        deserialize_with = "some_count",
        skip_serializing_if = "Option::is_none"
    )]
    pub t_sent_boot_ns: Option<u64>,
    /// The records, by sensor; at most [`SENSORS_MAX`].
    #[serde(deserialize_with = "list")]
    pub sensors: Vec<SensorBatch>,
}

/// The records of one sensor within a batch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorBatch {
    /// The sensor's place on the device.
    pub sensor: String,
    /// The agent's own count, so that read = stored + dropped + spooled can be checked at any moment.
    #[serde(
        default,
        deserialize_with = "object",
        skip_serializing_if = "Option::is_none"
    )]
    pub account: Option<Account>,
    /// Records in ascending `seq`; at most [`FRAMES_MAX`] in a batch.
    #[serde(deserialize_with = "list")]
    pub frames: Vec<Record>,
}

/// An agent's count of one stream since its start.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Account {
    /// Sensor frames read from the bus.
    #[serde(deserialize_with = "count")]
    pub read: u64,
    /// Sensor frames known to be missed; each is sent as a record with a reason.
    #[serde(deserialize_with = "count")]
    pub missing: u64,
    /// Frames read, then dropped before they were stored, by reason; at most [`REASONS_MAX`].
    #[serde(deserialize_with = "counts::<Reason, _>")]
    pub dropped: BTreeMap<String, u64>,
    /// Frames read and not yet acknowledged, including those of this batch.
    #[serde(deserialize_with = "count")]
    pub spooled: u64,
    /// Faults on the bus by kind: the names of `NoData`, and others that cost no frame; at most [`REASONS_MAX`].
    #[serde(deserialize_with = "counts::<Reason, _>")]
    pub errors: BTreeMap<String, u64>,
    /// The boot is over: a frame that is neither in `spooled` nor stored by now is lost ([`LOST_IN_MEMORY`]). Omitted
    /// unless true.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ended: bool,
}

/// The reason for frames that were in the memory of a killed agent.
pub const LOST_IN_MEMORY: &str = "lost-in-memory";

/// The reason for frames that the collector acknowledged and lost, for example by the restore of an older store.
pub const LOST_BY_COLLECTOR: &str = "lost-by-collector";

/// How many ended boots an agent reports again to a collector that lost frames. A collector knows at least that many
/// boots of a sensor, however old their frames are.
pub const BOOTS_TOLD_AGAIN: usize = 8;

/// The collector's answer, sent after commit and sync.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Acknowledgement {
    /// By sensor: every record sent with this `seq` or a lower one is on disk, except the gaps.
    #[serde(deserialize_with = "counts::<SensorBatch, _>")]
    pub durable_through: BTreeMap<String, u64>,
    /// Sequence numbers below `durable_through` that never arrived; at most [`GAPS_MAX`].
    #[serde(deserialize_with = "list")]
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

/// Maximum sensors in a batch, or in an answer's `durable_through`: two on each bus of a Raspberry Pi, plus a
/// multiplexer.
pub const SENSORS_MAX: usize = 32;

/// Maximum frames in a batch, all sensors together: nearly seven minutes of one sensor at 10 Hz, for catching up.
pub const FRAMES_MAX: usize = 4096;

/// Maximum reasons in `dropped`, and in `errors`, of one account: about five times the existing kinds of faults.
pub const REASONS_MAX: usize = 64;

/// Maximum gaps in an answer: one per frame of the largest batch.
pub const GAPS_MAX: usize = FRAMES_MAX;

/// Maximum JSON size of one frame as written here, in bytes, including the comma after it.
pub const FRAME_BYTES_MAX: usize = 533;

/// A reason in an [`Account`].
pub(super) struct Reason;

macro_rules! bounded {
    ($($what:ty: $max:ident $many:literal $limit_of:literal)*) => {
        $(impl Bounded for $what {
            const MAX: usize = $max;
            const MANY: &'static str = $many;
            const LIMIT_OF: &'static str = $limit_of;
        })*
    };
}

bounded! {
    SensorBatch: SENSORS_MAX "sensors" "sensors"
    Record: FRAMES_MAX "frames" "frames in all"
    Reason: REASONS_MAX "reasons" "reasons"
    Gap: GAPS_MAX "gaps" "gaps"
}

macro_rules! objects {
    ($($what:ty: $expected:literal)*) => {
        $(impl Expected for $what {
            const EXPECTED: &'static str = concat!("an object with ", $expected);
        })*
    };
}

objects! {
    Batch: "device, boot and sensors"
    SensorBatch: "sensor and frames"
    Account: "read, missing, dropped, spooled and errors"
    Record: "seq, t_boot_ns, t_utc_ns, clock and a frame or `missing`"
    Acknowledgement: "durable_through and gaps"
    Gap: "sensor, from and to"
}
