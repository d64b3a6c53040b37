//! The log without `alloc`: tracing is unavailable.

use crate::fault::FaultSet;
use crate::signal::{Acknowledge, BusError};
use core::num::NonZeroU32;
use core::time::Duration;

#[derive(Debug, Default)]
pub(crate) struct Log {}

impl Log {
    pub(crate) const fn is_on(&self) -> bool {
        false
    }

    pub(crate) const fn happened(&mut self, _: FaultSet) {}

    pub(crate) const fn start(&mut self, _: u8, _: bool, _: Duration, _: u64) {}

    pub(crate) const fn byte(&mut self, _: u8) {}

    pub(crate) const fn end(
        &mut self,
        _: Duration,
        _: Option<NonZeroU32>,
        _: bool,
        _: Acknowledge,
        _: Option<BusError>,
        _: FaultSet,
    ) {
    }
}
