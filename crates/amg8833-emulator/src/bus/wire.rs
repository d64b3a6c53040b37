//! SCL and SDA with their clock: counts, times and traces every bit.

use crate::bus::line::Wires;
use crate::clock::Clock;
use crate::fault::FaultSet;
use crate::signal::{Ack, Acknowledge, BusError, HANG_TIMEOUT, Outcome, Traffic};
use crate::source::FrameSource;
use crate::trace::Log;
use core::num::NonZeroU32;
use core::time::Duration;
use embedded_hal::i2c::{NoAcknowledgeSource, Operation};

/// An address or data byte with its acknowledge.
const BITS_PER_BYTE: u64 = 9;
const NANOSECONDS_PER_SECOND: u128 = 1_000_000_000;

/// The bus clock of a Raspberry Pi, an Arduino and CircuitPython unless told otherwise.
pub const SCL_HZ: NonZeroU32 = match NonZeroU32::new(100_000) {
    Some(hz) => hz,
    None => NonZeroU32::MIN,
};

pub(crate) type Acknowledged = Result<(), NoAcknowledgeSource>;

/// Carries out the next operation of a transaction that is still open; an error says which byte was not acknowledged.
pub type Carry<'a> = &'a mut dyn FnMut(&mut Operation<'_>) -> Result<(), NoAcknowledgeSource>;

/// Decides the operations of a transaction while it is open.
pub(crate) type Talk<'t> = &'t mut dyn FnMut(Carry<'_>);

/// Operations that are known before, up to the first that is not acknowledged.
pub(crate) fn known(operations: &mut [Operation<'_>]) -> impl FnMut(Carry<'_>) {
    |carry| {
        let _ = operations.iter_mut().try_for_each(carry);
    }
}

#[derive(Debug)]
pub(crate) struct Wire<C> {
    pub(crate) clock: C,
    pub(crate) scl_hz: Option<NonZeroU32>,
    imposed_hz: Option<NonZeroU32>,
    /// The bits' time beyond whole nanoseconds so far, in units of 1/frequency of a nanosecond.
    rest: u128,
    pub(crate) traffic: Traffic,
    pub(crate) log: Log,
}

impl<C: Clock> Wire<C> {
    pub(crate) fn new(clock: C) -> Self {
        Self {
            clock,
            scl_hz: Some(SCL_HZ),
            imposed_hz: None,
            rest: 0,
            traffic: Traffic::default(),
            log: Log::default(),
        }
    }

    pub(crate) fn impose(&mut self, hz: Option<NonZeroU32>) {
        if self.imposed_hz != hz {
            self.imposed_hz = hz;
            self.rest = 0;
        }
    }

    /// Runs one transaction up to its STOP. `happened` appears in the trace with its first message.
    pub(crate) fn carry<S: FrameSource, const N: usize>(
        &mut self,
        address: u8,
        wires: &mut Wires<'_, S, N>,
        talk: Talk<'_>,
        happened: FaultSet,
    ) -> Outcome {
        self.begin(happened);
        let (mut reading, mut result) = (None, Ok(()));
        talk(&mut |operation| {
            let outcome = self.operation(address, wires, &mut reading, operation);
            result = result.and(outcome);
            outcome
        });
        self.end(address, wires, result)
    }

    /// Counts a transaction, whose START comes with its first operation.
    pub(crate) fn begin(&mut self, happened: FaultSet) {
        self.traffic.transactions += 1;
        self.log.happened(happened);
    }

    /// STOP.
    pub(crate) fn end<S: FrameSource, const N: usize>(
        &mut self,
        address: u8,
        wires: &mut Wires<'_, S, N>,
        result: Acknowledged,
    ) -> Outcome {
        self.bits(1);
        let error = result.err();
        let acknowledge = match error {
            None => Acknowledge::All,
            Some(NoAcknowledgeSource::Data) => Acknowledge::NotLastByte,
            Some(_) => Acknowledge::NotAddress,
        };
        let error = error.map(|source| BusError::NoAcknowledge { address, source });
        self.end_message(true, acknowledge, error, || wires.take_struck());
        error.map_or(Ok(()), Err)
    }

    /// A transaction that stops after START and the address byte; without an adapter, before them.
    pub(crate) fn fail(&mut self, address: u8, reads: bool, error: BusError, faults: FaultSet) {
        self.log.happened(faults);
        let now = self.clock.now();
        if error == BusError::Gone {
            self.log.start(address, reads, now, 0);
        } else {
            self.traffic.transactions += 1;
            let number = self.traffic.transactions;
            self.log.start(address, reads, now, number);
            self.bits(1);
            self.byte();
        }
        if error == BusError::Timeout {
            self.clock.pass(HANG_TIMEOUT);
        }
        self.end_message(
            false,
            Acknowledge::NotAddress,
            Some(error),
            FaultSet::default,
        );
    }

    /// One operation, after the START that a change of direction needs.
    pub(crate) fn operation<S: FrameSource, const N: usize>(
        &mut self,
        address: u8,
        wires: &mut Wires<'_, S, N>,
        reading: &mut Option<bool>,
        operation: &mut Operation<'_>,
    ) -> Acknowledged {
        let reads = is_read(operation);
        if reading.replace(reads) != Some(reads) {
            self.address(address, wires, reads)?;
        }
        match operation {
            Operation::Read(bytes) => {
                for byte in bytes.iter_mut() {
                    *byte = wires.read(self.clock.now());
                    self.log.byte(*byte);
                    self.byte();
                }
            }
            Operation::Write(bytes) => {
                for byte in *bytes {
                    self.byte();
                    self.log.byte(*byte);
                    let ack = wires.write(*byte, self.clock.now());
                    self.acknowledged(ack, NoAcknowledgeSource::Data)?;
                }
            }
        }
        Ok(())
    }

    /// START or repeated START, which freezes the registers, and the address byte.
    fn address<S: FrameSource, const N: usize>(
        &mut self,
        address: u8,
        wires: &mut Wires<'_, S, N>,
        reads: bool,
    ) -> Acknowledged {
        let now = self.clock.now();
        if self.log.is_on() {
            self.end_message(false, Acknowledge::All, None, || wires.take_struck());
            let number = self.traffic.transactions;
            self.log.start(address, reads, now, number);
        }
        let ack = wires.start(reads, now);
        self.bits(1);
        self.byte();
        self.acknowledged(ack, NoAcknowledgeSource::Address)
    }

    fn acknowledged(&mut self, ack: Ack, source: NoAcknowledgeSource) -> Acknowledged {
        if ack == Ack::Ack {
            return Ok(());
        }
        self.traffic.nacks += 1;
        Err(source)
    }

    fn end_message(
        &mut self,
        stop: bool,
        acknowledge: Acknowledge,
        error: Option<BusError>,
        struck: impl FnOnce() -> FaultSet,
    ) {
        if self.log.is_on() {
            let (now, hz) = (self.clock.now(), self.hz());
            self.log.end(now, hz, stop, acknowledge, error, struck());
        }
    }

    fn hz(&self) -> Option<NonZeroU32> {
        self.imposed_hz.or(self.scl_hz)
    }

    fn byte(&mut self) {
        self.traffic.bytes += 1;
        self.bits(BITS_PER_BYTE);
    }

    /// Passes the time of these bits, START and STOP included; each rounding error carries over to the next call.
    fn bits(&mut self, count: u64) {
        self.traffic.bits += count;
        let Some(hz) = self.hz() else {
            return;
        };
        let hz = u128::from(hz.get());
        let parts = u128::from(count) * NANOSECONDS_PER_SECOND + self.rest;
        self.rest = parts % hz;
        if let Ok(nanoseconds @ 1..) = u64::try_from(parts / hz) {
            self.clock.pass(Duration::from_nanos(nanoseconds));
        }
    }
}

pub(crate) fn is_read(operation: &Operation<'_>) -> bool {
    matches!(operation, Operation::Read(_))
}
