//! How a message on the bus ended.

use crate::fault::FaultSet;
use crate::signal::BusError;
use core::num::NonZeroU32;
use core::time::Duration;

/// How much of a message was acknowledged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(
    not(feature = "alloc"),
    expect(
        unreachable_pub,
        reason = "the trace is public with the feature alloc only"
    )
)]
pub enum Acknowledge {
    /// The address, and every byte that was written.
    All,
    /// The address was not.
    NotAddress,
    /// The last of the bytes, which was written, was not.
    NotLastByte,
}

/// How a message ended.
#[derive(Clone, Copy)]
#[cfg_attr(
    not(feature = "alloc"),
    expect(dead_code, reason = "nobody traces the bus without the feature alloc")
)]
pub(crate) struct Ending {
    pub(crate) at: Duration,
    pub(crate) scl_hz: Option<NonZeroU32>,
    pub(crate) stop: bool,
    pub(crate) acknowledge: Acknowledge,
    pub(crate) error: Option<BusError>,
    pub(crate) faults: FaultSet,
}
