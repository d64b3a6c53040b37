//! Assembles messages for the trace.

use crate::fault::FaultSet;
use crate::signal::{Acknowledge, BusError};
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
    /// Repeated START: the transaction continues.
    Repeated,
    /// No START: the adapter is gone.
    Never,
}

/// One message on the bus: an address, a direction, and the bytes up to a repeated START or a STOP.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Transfer<'a> {
    /// The number of its transaction on the bus, from 1.
    pub transaction: u64,
    /// The time of its START on the bus's clock.
    pub started: Duration,
    /// The time of its STOP, or of the event that ended it.
    pub ended: Duration,
    /// Clock pulses per second; `None` on a bus with instant transactions.
    pub scl_hz: Option<NonZeroU32>,
    /// How the message began.
    pub start: Start,
    /// Whether a STOP ended it; otherwise a repeated START did, or the controller gave up.
    pub stop: bool,
    /// The seven bits of the address.
    pub address: u8,
    /// Whether the sensor sends.
    pub reads: bool,
    /// The bytes as the controller knows them. A written byte that was not acknowledged is the last one.
    pub bytes: &'a [u8],
    /// What was acknowledged.
    pub acknowledge: Acknowledge,
    /// The error the controller reported.
    pub error: Option<BusError>,
    /// The faults that struck in this message, the lasting ones, and those of the frame read.
    pub faults: FaultSet,
}

type Observer = Box<dyn FnMut(&Transfer<'_>) + Send>;

/// A transaction's messages, kept for other buses on the same wires.
pub(crate) type Kept = Vec<(Transfer<'static>, Vec<u8>)>;

/// Assembles messages; does nothing without an observer.
#[derive(Default)]
pub(crate) struct Log {
    pub(crate) observer: Option<Observer>,
    /// The current message, without its bytes and end.
    begun: Option<Transfer<'static>>,
    bytes: Vec<u8>,
    happened: FaultSet,
    kept: Option<Kept>,
}

impl Log {
    #[inline]
    pub(crate) fn is_on(&self) -> bool {
        self.observer.is_some() || self.kept.is_some()
    }

    /// Starts keeping messages for other buses on the same wires.
    pub(crate) fn keep(&mut self) {
        self.kept = Some(Vec::new());
    }

    pub(crate) fn take_kept(&mut self) -> Kept {
        self.kept.take().unwrap_or_default()
    }

    pub(crate) fn tell(&mut self, kept: &Kept) {
        if let Some(observer) = &mut self.observer {
            for (transfer, bytes) in kept {
                observer(&Transfer { bytes, ..*transfer });
            }
        }
    }

    pub(crate) fn happened(&mut self, faults: FaultSet) {
        if self.is_on() {
            self.happened.join(faults);
        }
    }

    /// Begins a message in this transaction; number 0 means the adapter is gone.
    pub(crate) fn start(&mut self, address: u8, reads: bool, now: Duration, transaction: u64) {
        if !self.is_on() {
            return;
        }
        let start = match (transaction, self.begun) {
            (0, _) => Start::Never,
            (_, None) => Start::First,
            (_, Some(_)) => Start::Repeated,
        };
        self.bytes.clear();
        self.begun = Some(Transfer {
            transaction,
            started: now,
            ended: now,
            scl_hz: None,
            start,
            stop: false,
            address,
            reads,
            bytes: &[],
            acknowledge: Acknowledge::All,
            error: None,
            faults: FaultSet::EMPTY,
        });
    }

    #[inline]
    pub(crate) fn byte(&mut self, byte: u8) {
        if self.begun.is_some() {
            self.bytes.push(byte);
        }
    }

    pub(crate) fn end(
        &mut self,
        now: Duration,
        scl_hz: Option<NonZeroU32>,
        stop: bool,
        acknowledge: Acknowledge,
        error: Option<BusError>,
        mut faults: FaultSet,
    ) {
        let Some(begun) = self.begun else {
            return;
        };
        faults.join(core::mem::take(&mut self.happened));
        let transfer = Transfer {
            ended: now,
            scl_hz,
            stop,
            acknowledge,
            error,
            faults,
            ..begun
        };
        if let Some(observer) = &mut self.observer {
            let bytes = &self.bytes;
            observer(&Transfer { bytes, ..transfer });
        }
        if let Some(kept) = &mut self.kept {
            kept.push((transfer, self.bytes.clone()));
        }
        self.bytes.clear();
        if stop || error.is_some() {
            self.begun = None;
        }
    }
}

impl fmt::Debug for Log {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Log").finish_non_exhaustive()
    }
}
