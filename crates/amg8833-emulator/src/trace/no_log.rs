//! The log of a build without `alloc`: nobody can trace the bus.

use super::message::Ending;
use crate::fault::FaultSet;
use core::time::Duration;

/// Nobody can trace the bus without the feature `alloc`.
#[derive(Debug)]
pub(crate) struct Log;

impl Log {
    pub(crate) const fn new() -> Self {
        Self
    }

    pub(crate) const fn is_on(&self) -> bool {
        false
    }

    pub(crate) const fn happened(&mut self, _faults: FaultSet) {}

    pub(crate) const fn start(&mut self, _to: u8, _reads: bool, _now: Duration, _number: u64) {}

    pub(crate) const fn never_start(&mut self, _to: u8, _reads: bool, _now: Duration) {}

    pub(crate) const fn byte(&mut self, _byte: u8) {}

    pub(crate) fn end(&mut self, _ending: Ending) {}
}
