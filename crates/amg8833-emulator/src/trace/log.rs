//! Puts messages together for whoever traces the bus.

use super::message::{Acknowledge, Ending};
use crate::fault::FaultSet;
use crate::signal::BusError;
use alloc::boxed::Box;
use alloc::vec::Vec;
use core::fmt;
use core::num::NonZeroU32;
use core::time::Duration;

/// How a message began.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// START.
    First,
    /// Repeated START: the transaction goes on.
    Repeated,
    /// Not at all: the adapter is gone.
    Never,
}

/// One message on the bus: an address, a direction, and the bytes up to a repeated START or a STOP.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Transfer<'a> {
    /// Which transaction of the bus it belongs to, from 1.
    pub transaction: u64,
    /// The time of its START on the bus's clock.
    pub started: Duration,
    /// The time of its STOP, or of what came instead.
    pub ended: Duration,
    /// Clock pulses a second; `None` on a bus whose transactions take no time.
    pub scl_hz: Option<NonZeroU32>,
    /// How it began.
    pub start: Start,
    /// Whether a STOP ended it; else a repeated START did, or the controller gave up.
    pub stop: bool,
    /// The seven bits of the address.
    pub address: u8,
    /// Whether the sensor sends.
    pub reads: bool,
    /// What was sent, as the controller knows it. When it was written and not acknowledged, the byte that was not is
    /// the last one.
    pub bytes: &'a [u8],
    /// What was acknowledged.
    pub acknowledge: Acknowledge,
    /// What the controller reported.
    pub error: Option<BusError>,
    /// The faults that struck in this message, those that lasted, and those of the frame that was read.
    pub faults: FaultSet,
}

type Observer = Box<dyn FnMut(&Transfer<'_>) + Send>;

struct Begun {
    transaction: u64,
    started: Duration,
    start: Start,
    address: u8,
    reads: bool,
}

/// Messages of a transaction that others still want to see.
type Kept = Vec<(Transfer<'static>, Vec<u8>)>;

/// Puts messages together for whoever traces the bus; without anybody, nothing is done.
pub(crate) struct Log {
    observer: Option<Observer>,
    begun: Option<Begun>,
    bytes: Vec<u8>,
    happened: FaultSet,
    kept: Option<Kept>,
}

impl Log {
    pub(crate) const fn new() -> Self {
        Self {
            observer: None,
            begun: None,
            bytes: Vec::new(),
            happened: FaultSet::EMPTY,
            kept: None,
        }
    }

    pub(crate) fn set(&mut self, observer: Option<Observer>) -> Option<Observer> {
        core::mem::replace(&mut self.observer, observer)
    }

    pub(crate) fn has_observer(&self) -> bool {
        self.observer.is_some()
    }

    #[inline]
    pub(crate) fn is_on(&self) -> bool {
        self.observer.is_some() || self.kept.is_some()
    }

    /// Keeps the messages from here on, for others on the same wires.
    pub(crate) fn keep(&mut self) {
        self.kept = Some(Vec::new());
    }

    pub(crate) fn take_kept(&mut self) -> Kept {
        self.kept.take().unwrap_or_default()
    }

    /// Tells the observer of a message that another bus saw.
    pub(crate) fn tell(&mut self, transfer: &Transfer<'_>) {
        if let Some(observer) = &mut self.observer {
            observer(transfer);
        }
    }

    pub(crate) fn happened(&mut self, faults: FaultSet) {
        if self.is_on() {
            self.happened.join(faults);
        }
    }

    pub(crate) fn start(&mut self, address: u8, reads: bool, now: Duration, number: u64) {
        if self.is_on() {
            let repeated = self.begun.is_some();
            let start = if repeated {
                Start::Repeated
            } else {
                Start::First
            };
            self.begin(start, address, reads, now, number);
        }
    }

    pub(crate) fn never_start(&mut self, address: u8, reads: bool, now: Duration) {
        if self.is_on() {
            self.begin(Start::Never, address, reads, now, 0);
        }
    }

    #[inline]
    pub(crate) fn byte(&mut self, byte: u8) {
        if self.begun.is_some() {
            self.bytes.push(byte);
        }
    }

    /// Ends the message under way, if there is one.
    pub(crate) fn end(&mut self, ending: Ending) {
        let last = ending.stop || ending.error.is_some();
        let Some(begun) = self.begun.as_ref() else {
            return;
        };
        let mut faults = core::mem::take(&mut self.happened);
        faults.join(ending.faults);
        let transfer = Transfer {
            transaction: begun.transaction,
            started: begun.started,
            ended: ending.at,
            scl_hz: ending.scl_hz,
            start: begun.start,
            stop: ending.stop,
            address: begun.address,
            reads: begun.reads,
            bytes: &[],
            acknowledge: ending.acknowledge,
            error: ending.error,
            faults,
        };
        self.publish(transfer);
        self.bytes.clear();
        if last {
            self.begun = None;
        }
    }

    fn begin(&mut self, start: Start, address: u8, reads: bool, now: Duration, number: u64) {
        self.bytes.clear();
        self.begun = Some(Begun {
            transaction: number,
            started: now,
            start,
            address,
            reads,
        });
    }

    fn publish(&mut self, transfer: Transfer<'static>) {
        if let Some(observer) = &mut self.observer {
            let bytes = &self.bytes;
            observer(&Transfer { bytes, ..transfer });
        }
        if let Some(kept) = &mut self.kept {
            kept.push((transfer, self.bytes.clone()));
        }
    }
}

impl fmt::Debug for Log {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Log")
            .field("on", &self.is_on())
            .finish_non_exhaustive()
    }
}
