//! The body of `POST /v1/frames` and of its answer: one batch per device and half second.
//!
//! ```
//! use grideye_recording::wire::{Batch, Limits};
//!
//! let body = br#"{"device":"pi-1","boot":"5f0c","sensors":[{"sensor":"i2c-1:0x69","frames":[
//!     {"seq":17,"t_boot_ns":81000000000,"t_utc_ns":1625163247274925000,"clock":"synced","missing":"nack"}]}]}"#;
//! let batch = Batch::from_json(body, &Limits::default()).unwrap();
//! assert_eq!(batch.sensors[0].frames[0].seq, 17);
//!
//! let error = Batch::from_json(br#"{"device":"=pi","boot":"5f0c","sensors":[]}"#, &Limits::default()).unwrap_err();
//! assert_eq!(error.path(), "device");
//! ```
//!
//! A body is refused as a whole or taken as a whole. Unknown and repeated fields, `null`, fractions, and anything that
//! is not asked for are refused, so that a slip of the sender shows at once and not as frames that are quietly wrong.

mod binary;
mod check;
mod decode;
mod encode;
mod error;

pub use error::WireError;

use crate::Record;
use std::collections::BTreeMap;

/// The content type of a body in JSON.
pub const JSON_TYPE: &str = "application/json";
/// The content type of a body in bytes, of the version that this crate writes.
pub const BINARY_TYPE: &str = "application/vnd.grideye.frames.v2";
/// The content type of the layout before, which is still read.
pub const BINARY_TYPE_PLAIN: &str = "application/vnd.grideye.frames.v1";

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
    /// The run is over, and a later run of the agent speaks for it: what is neither in `spooled` nor in the store by now
    /// is lost, and the collector counts it as [`LOST_IN_MEMORY`]. Left out on the wire unless true.
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
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gap {
    /// The sensor.
    pub sensor: String,
    /// First missing number.
    pub from: u64,
    /// Last missing number.
    pub to: u64,
}

/// How much one body may hold. What is beyond is refused while it is read, before it is kept.
///
/// The size of the body itself is for whoever receives it to limit: a frame takes at most [`FRAME_BYTES_MAX`] of it.
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

impl Batch {
    /// Reads the body of a post.
    ///
    /// # Errors
    ///
    /// [`WireError`] for the first fault, with the path of the field, what was expected there and what was found.
    pub fn from_json(json: &[u8], limits: &Limits) -> Result<Self, WireError> {
        let batch = decode::batch(json, limits)?;
        check::batch(&batch)?;
        Ok(batch)
    }

    /// Writes the body of a post, without white space.
    ///
    /// # Errors
    ///
    /// [`WireError`] for what [`Batch::from_json`] would refuse whatever its limits: names, order, repeated sensors, and
    /// counts beyond [`COUNT_MAX`](crate::COUNT_MAX).
    pub fn to_json(&self) -> Result<Vec<u8>, WireError> {
        check::batch(self)?;
        encode::batch(self)
    }

    /// Reads the body of a post in its compact form ([`BINARY_TYPE`]), with the same checks and limits as JSON.
    ///
    /// # Errors
    ///
    /// [`WireError`] for the first fault, with the path of the field, what was expected there and what was found.
    pub fn from_binary(body: &[u8], limits: &Limits) -> Result<Self, WireError> {
        let batch = binary::decode(body, limits)?;
        check::batch(&batch)?;
        Ok(batch)
    }

    /// Writes the body of a post in its compact form: 62 to 78 bytes for a frame of a room, 158 at most, beside what names
    /// them.
    ///
    /// # Errors
    ///
    /// [`WireError`] for what [`Batch::from_binary`] would refuse whatever its limits.
    pub fn to_binary(&self) -> Result<Vec<u8>, WireError> {
        let mut body = Vec::new();
        self.append_binary(&mut body)?;
        Ok(body)
    }

    /// Writes the same behind what is in `body` already.
    ///
    /// # Errors
    ///
    /// As [`Batch::to_binary`]; then nothing is written.
    pub fn append_binary(&self, body: &mut Vec<u8>) -> Result<(), WireError> {
        check::batch(self)?;
        binary::encode(self, body);
        Ok(())
    }
}

impl Acknowledgement {
    /// Reads the answer to a post.
    ///
    /// # Errors
    ///
    /// [`WireError`] for the first fault, with the path of the field, what was expected there and what was found.
    pub fn from_json(json: &[u8], limits: &Limits) -> Result<Self, WireError> {
        let acknowledgement = decode::acknowledgement(json, limits)?;
        check::acknowledgement(&acknowledgement)?;
        Ok(acknowledgement)
    }

    /// Writes the answer to a post, without white space.
    ///
    /// # Errors
    ///
    /// [`WireError`] for what [`Acknowledgement::from_json`] would refuse whatever its limits.
    pub fn to_json(&self) -> Result<Vec<u8>, WireError> {
        check::acknowledgement(self)?;
        let durable_through = self.durable_through.iter();
        let durable_through = durable_through.map(|(sensor, seq)| (sensor.as_str(), *seq));
        encode::acknowledgement(durable_through, self.gaps.iter())
    }

    /// Writes the same from where it stands, of sensors and numbers that a body was read with: each sensor once, and the
    /// highest number below which all is on disk, but for the gaps.
    ///
    /// # Errors
    ///
    /// [`WireError`] if it cannot be written as JSON.
    pub fn write_json<'a>(
        durable_through: impl Iterator<Item = (&'a str, u64)> + Clone,
        gaps: impl Iterator<Item = &'a Gap> + Clone,
    ) -> Result<Vec<u8>, WireError> {
        encode::acknowledgement(durable_through, gaps)
    }
}
