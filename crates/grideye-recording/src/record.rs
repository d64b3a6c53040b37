//! One sensor frame as it is kept: who measured it, which one it is, when, and what the bus said.

use grideye_frame::{RawFrame, Reading};

/// Whose frames: the part of a frame's identity that a whole stream shares.
///
/// Together with [`Record::seq`] this names one sensor frame for ever.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StreamId {
    /// The agent's name, for example `pi-1`.
    pub device: String,
    /// The sensor's place on the device, for example `i2c-1:0x69`.
    pub sensor: String,
    /// One run of the agent since the device started: sequence numbers begin again with each.
    pub boot: String,
}

/// What the agent knew of its wall clock when it stamped a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ClockState {
    /// Never set since the device started: a Raspberry Pi has no battery clock.
    Unsynced,
    /// Set, by NTP or its like.
    Synced,
    /// Set, and moved by a jump since the frame before.
    Stepped,
}

/// When a frame was read. Wall time is never a key and never an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Stamp {
    /// `CLOCK_BOOTTIME` of the device, in nanoseconds.
    pub t_boot_ns: u64,
    /// Wall clock of the device, in nanoseconds since 1970-01-01 UTC.
    pub t_utc_ns: i64,
    /// How far the wall clock is to be believed.
    pub clock: ClockState,
}

/// One sensor frame, read or missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record {
    /// Counts sensor frames from 0 within a stream; a jump is a gap.
    pub seq: u64,
    /// When it was read, or found to be missing.
    pub stamp: Stamp,
    /// What the bus said, or why it said nothing.
    pub reading: Reading<RawFrame>,
}
