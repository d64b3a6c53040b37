//! SCL and SDA with their clock: what passes is counted, takes its time, and is told to whoever traces it.

use crate::clock::Clock;
use crate::fault::FaultSet;
use crate::signal::{Ack, BusError, HANG_TIMEOUT, Traffic};
use crate::trace::{Acknowledge, Ending, Log};
use core::num::NonZeroU32;
use core::time::Duration;
use embedded_hal::i2c::{NoAcknowledgeSource, Operation};

/// An address byte or a byte of data, with its acknowledge.
const BITS_PER_BYTE: u64 = 9;
const NANOSECONDS_PER_SECOND: u128 = 1_000_000_000;

/// What answers on the wire: one sensor, none, or several at once.
pub(crate) trait Target {
    /// START or repeated START, and the address.
    fn start(&mut self, reads: bool, now: Duration) -> Ack;
    fn write(&mut self, byte: u8, now: Duration) -> Ack;
    fn read(&mut self, now: Duration) -> u8;
    /// Which faults struck since this was asked last.
    fn take_struck(&mut self) -> FaultSet;
}

/// Nobody has this address.
pub(crate) struct Nobody;

impl Target for Nobody {
    fn start(&mut self, _reads: bool, _now: Duration) -> Ack {
        Ack::Nack
    }

    fn write(&mut self, _byte: u8, _now: Duration) -> Ack {
        Ack::Nack
    }

    fn read(&mut self, _now: Duration) -> u8 {
        0xFF
    }

    fn take_struck(&mut self) -> FaultSet {
        FaultSet::EMPTY
    }
}

#[derive(Debug)]
pub(crate) struct Wire<C> {
    pub(crate) clock: C,
    scl_hz: Option<NonZeroU32>,
    /// The frequency that a fault imposes.
    imposed_hz: Option<NonZeroU32>,
    /// What the bits so far took beyond whole nanoseconds, in parts of one by the frequency.
    rest: u128,
    pub(crate) traffic: Traffic,
    pub(crate) log: Log,
}

impl<C: Clock> Wire<C> {
    pub(crate) const fn new(clock: C) -> Self {
        Self {
            clock,
            scl_hz: None,
            imposed_hz: None,
            rest: 0,
            traffic: Traffic {
                transactions: 0,
                bytes: 0,
                bits: 0,
                nacks: 0,
            },
            log: Log::new(),
        }
    }

    pub(crate) fn set_scl_hz(&mut self, scl_hz: NonZeroU32) {
        self.scl_hz = Some(scl_hz);
        self.rest = 0;
    }

    /// What a fault makes of the frequency from now on.
    pub(crate) fn impose(&mut self, hz: Option<NonZeroU32>) {
        if self.imposed_hz != hz {
            self.imposed_hz = hz;
            self.rest = 0;
        }
    }

    /// One transaction up to its STOP. `happened` is what the trace shows with its first message.
    pub(crate) fn carry(
        &mut self,
        address: u8,
        target: &mut impl Target,
        operations: &mut [Operation<'_>],
        happened: FaultSet,
    ) -> Result<(), BusError> {
        self.traffic.transactions += 1;
        self.log.happened(happened);
        let result = self.exchange(address, target, operations);
        self.condition();
        let error = result.err();
        let acknowledge = match error {
            None => Acknowledge::All,
            Some(NoAcknowledgeSource::Data) => Acknowledge::NotLastByte,
            Some(_) => Acknowledge::NotAddress,
        };
        let error = error.map(|source| BusError::NoAcknowledge { address, source });
        self.end_message(true, acknowledge, error, target);
        error.map_or(Ok(()), Err)
    }

    /// START and the address byte, and then no further; without an adapter, not even those.
    pub(crate) fn fail(&mut self, address: u8, reads: bool, error: BusError, faults: FaultSet) {
        self.log.happened(faults);
        let now = self.clock.now();
        if error == BusError::Gone {
            self.log.never_start(address, reads, now);
        } else {
            self.traffic.transactions += 1;
            let traffic = self.traffic;
            self.log.start(address, reads, now, traffic.transactions);
            self.condition();
            self.byte();
        }
        if error == BusError::Timeout {
            self.clock.pass(HANG_TIMEOUT);
        }
        self.end_message(false, Acknowledge::NotAddress, Some(error), &mut Nobody);
    }

    fn exchange(
        &mut self,
        address: u8,
        target: &mut impl Target,
        operations: &mut [Operation<'_>],
    ) -> Result<(), NoAcknowledgeSource> {
        let mut reading = None;
        for operation in operations {
            let reads = is_read(operation);
            if reading.replace(reads) != Some(reads) {
                self.address(address, target, reads)?;
            }
            match operation {
                Operation::Read(bytes) => self.read(target, bytes),
                Operation::Write(bytes) => self.write(target, bytes)?,
            }
        }
        Ok(())
    }

    /// START or repeated START, at which the registers come to a stand, and the address byte.
    fn address(
        &mut self,
        address: u8,
        target: &mut impl Target,
        reads: bool,
    ) -> Result<(), NoAcknowledgeSource> {
        let now = self.clock.now();
        if self.log.is_on() {
            self.end_message(false, Acknowledge::All, None, target);
            let number = self.traffic.transactions;
            self.log.start(address, reads, now, number);
        }
        let ack = target.start(reads, now);
        self.condition();
        self.byte();
        self.acknowledged(ack, NoAcknowledgeSource::Address)
    }

    fn write(&mut self, target: &mut impl Target, bytes: &[u8]) -> Result<(), NoAcknowledgeSource> {
        for byte in bytes {
            self.byte();
            self.log.byte(*byte);
            let ack = target.write(*byte, self.clock.now());
            self.acknowledged(ack, NoAcknowledgeSource::Data)?;
        }
        Ok(())
    }

    fn read(&mut self, target: &mut impl Target, bytes: &mut [u8]) {
        for byte in bytes {
            *byte = target.read(self.clock.now());
            self.log.byte(*byte);
            self.byte();
        }
    }

    fn acknowledged(
        &mut self,
        ack: Ack,
        source: NoAcknowledgeSource,
    ) -> Result<(), NoAcknowledgeSource> {
        match ack {
            Ack::Ack => Ok(()),
            Ack::Nack => {
                self.traffic.nacks += 1;
                Err(source)
            }
        }
    }

    fn end_message(
        &mut self,
        stop: bool,
        acknowledge: Acknowledge,
        error: Option<BusError>,
        target: &mut impl Target,
    ) {
        if self.log.is_on() {
            self.log.end(Ending {
                at: self.clock.now(),
                scl_hz: self.imposed_hz.or(self.scl_hz),
                stop,
                acknowledge,
                error,
                faults: target.take_struck(),
            });
        }
    }

    fn byte(&mut self) {
        self.traffic.bytes += 1;
        self.bits(BITS_PER_BYTE);
    }

    fn condition(&mut self) {
        self.bits(1);
    }

    /// Passes the time of these bits; what one call rounds off, a later one makes up for.
    fn bits(&mut self, count: u64) {
        self.traffic.bits += count;
        let Some(hz) = self.imposed_hz.or(self.scl_hz) else {
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
