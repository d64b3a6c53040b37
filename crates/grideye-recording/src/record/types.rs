//! A sensor frame as kept: its stream and number, its time, and the words from the bus.

use crate::text::quoted;
use core::fmt;
use core::str::FromStr;
use grideye_frame::{NAME_CHARS_MAX, NAME_RULE, Reading, RecordedFrame, is_name};

/// The stream of a frame. With [`Record::seq`] it identifies one sensor frame permanently.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StreamId {
    /// The agent's name, for example `pi-1`.
    pub device: String,
    /// The sensor's place on the device, for example `i2c-1:0x69`.
    pub sensor: String,
    /// One start of the agent; sequence numbers begin again with each.
    pub boot: String,
}

impl StreamId {
    /// Whether a person who says `sensor` or `device/sensor` means this stream's sensor.
    #[must_use]
    pub fn is_of(&self, sensor: &str) -> bool {
        let of_device = sensor.strip_prefix(self.device.as_str());
        let of_device = of_device.and_then(|rest| rest.strip_prefix('/'));
        sensor == self.sensor || of_device == Some(self.sensor.as_str())
    }
}

grideye_frame::named! {
    /// State of the agent's wall clock when it stamped a frame, with its name on the wire and in files.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub enum ClockState {
        /// Never set since the device started: a Raspberry Pi has no battery clock.
        Unsynced = "unsynced";
        /// Set by NTP or a similar service.
        Synced = "synced";
        /// Set, and stepped since the previous frame.
        Stepped = "stepped";
    }
}

impl ClockState {
    /// The state's number in every binary form: on the wire, in the agent's spool, in the collector's store.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Unsynced => 0,
            Self::Synced => 1,
            Self::Stepped => 2,
        }
    }

    /// The inverse of [`ClockState::code`].
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|state| state.code() == code)
    }
}

impl fmt::Display for ClockState {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

impl FromStr for ClockState {
    type Err = UnknownClockState;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::from_name(name).ok_or(UnknownClockState)
    }
}

/// The name is not a [`ClockState`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no such clock state; expected {CLOCK_STATES}")]
pub struct UnknownClockState;

/// The clock's description in error messages.
pub(crate) const CLOCK_STATES: &str = "one of unsynced synced stepped";

/// When a frame was read. Wall time is never a key and never defines order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Stamp {
    /// `CLOCK_BOOTTIME` of the device, in nanoseconds; at most [`COUNT_MAX`] on the wire and in files.
    pub t_boot_ns: u64,
    /// Wall clock of the device, in nanoseconds since 1970-01-01 UTC.
    pub t_utc_ns: i64,
    /// How far to trust the wall clock.
    pub clock: ClockState,
}

/// One sensor frame, read or missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record {
    /// Number of the sensor frame within its stream, from 0; a jump is a gap. At most [`COUNT_MAX`] on the wire and in
    /// files.
    pub seq: u64,
    /// When it was read, or found missing.
    pub stamp: Stamp,
    /// The words from the bus, or why there are none.
    pub reading: Reading<RecordedFrame>,
}

/// The largest sequence number, boot time or count on the wire and in files; SQLite, PostgreSQL and pandas share this
/// limit.
pub const COUNT_MAX: u64 = i64::MAX.unsigned_abs();

/// Checks whether a device, sensor or boot may have this name on the wire and in files: whether it [`is_name`].
///
/// ```
/// assert!(grideye_recording::check_name("i2c-1:0x69").is_ok());
/// assert!(grideye_recording::check_name("=cmd()").is_err());
/// ```
///
/// # Errors
/// [`NameError`] with the name, cut when long.
pub fn check_name(name: &str) -> Result<(), NameError> {
    if is_name(name) {
        return Ok(());
    }
    Err(NameError {
        found: match name.chars().count() {
            chars if chars > NAME_CHARS_MAX => format!("{chars} characters: {}", quoted(name)),
            _ => quoted(name),
        },
    })
}

/// A name that [`check_name`] rejects.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {NAME_RULE}, found {found}")]
pub struct NameError {
    /// The name in quotation marks, cut when long.
    pub found: String,
}

/// One row of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// The frame's stream.
    pub stream: StreamId,
    /// The frame, or the reason why there is none. CSV keeps only twelve bits of each word.
    pub record: Record,
    /// The collector's wall clock when the frame arrived, in nanoseconds since 1970-01-01 UTC, if known.
    pub t_arrival_ns: Option<i64>,
    /// What else the recording says of this frame: one text for each further column, in their order.
    pub labels: Vec<String>,
}
