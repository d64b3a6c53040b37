//! The body of `POST /v1/frames` and of its answer: one batch per device and half second.

use crate::Record;
use std::collections::BTreeMap;

/// What an agent posts: the records of all its sensors since the last post.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// The agent's name.
    pub device: String,
    /// The run of the agent.
    pub boot: String,
    /// The agent's `CLOCK_BOOTTIME` when it sent this, in nanoseconds; tells the age of each frame without wall clocks.
    pub t_sent_boot_ns: Option<u64>,
    /// The records, by sensor.
    pub sensors: Vec<SensorBatch>,
}

/// The records of one sensor within a batch.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorBatch {
    /// The sensor's place on the device.
    pub sensor: String,
    /// The agent's own count, so that read = stored + dropped + spooled can be audited at any moment.
    pub account: Option<Account>,
    /// Records in ascending `seq`.
    pub frames: Vec<Record>,
}

/// An agent's count of one stream, from its start.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
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
}

/// The collector's answer, given after commit and sync.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Acknowledgement {
    /// By sensor: every record sent with this `seq` or a lower one is on disk, but for the gaps.
    pub durable_through: BTreeMap<String, u64>,
    /// Sequence numbers below `durable_through` that never came.
    pub gaps: Vec<Gap>,
}

/// A run of sequence numbers that the collector does not have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gap {
    /// The sensor.
    pub sensor: String,
    /// First missing number.
    pub from: u64,
    /// Last missing number.
    pub to: u64,
}
