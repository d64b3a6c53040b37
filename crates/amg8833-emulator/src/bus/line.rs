//! The devices that hear one transaction: sensors with their faults, and a multiplexer.

use crate::device::Device;
use crate::fault::active::{Faults, Plan};
use crate::fault::{FaultKind, FaultSet};
use crate::signal::{Ack, Address};
use crate::source::FrameSource;
use core::time::Duration;

#[derive(Debug, Default)]
pub(crate) struct Control {
    /// The selected channels: bit n is channel n.
    pub(crate) selected: u8,
    /// Whether the transaction has the multiplexer's address.
    pub(crate) answers: bool,
    pub(crate) written: Option<u8>,
}

/// Everything that hears a transaction: a multiplexer, and a sensor on each of up to `N` buses.
pub(crate) struct Wires<'a, S, const N: usize> {
    pub(crate) control: &'a mut Control,
    pub(crate) lines: [Option<Line<'a, S>>; N],
}

impl<S: FrameSource, const N: usize> Wires<'_, S, N> {
    pub(crate) fn start(&mut self, reads: bool, now: Duration) -> Ack {
        self.any(|line| line.start(reads, now))
    }

    pub(crate) fn write(&mut self, byte: u8, now: Duration) -> Ack {
        if self.control.answers {
            self.control.written = Some(byte);
        }
        self.any(|line| line.write(byte, now))
    }

    /// Any device can pull SDA low.
    pub(crate) fn read(&mut self, now: Duration) -> u8 {
        let released = if self.control.answers {
            self.control.selected
        } else {
            0xFF
        };
        let lines = self.lines.iter_mut().flatten();
        lines.fold(released, |byte, line| byte & line.read(now))
    }

    /// Takes the faults that struck since the last call.
    pub(crate) fn take_struck(&mut self) -> FaultSet {
        let mut all = FaultSet::EMPTY;
        for line in self.lines.iter_mut().flatten() {
            all.join(line.take_struck());
        }
        all
    }

    /// Passes the event to every sensor; `Ack` if any device acknowledges.
    fn any(&mut self, mut ack: impl FnMut(&mut Line<'_, S>) -> Ack) -> Ack {
        let mut any = self.control.answers;
        for line in self.lines.iter_mut().flatten() {
            any |= ack(line) == Ack::Ack;
        }
        if any { Ack::Ack } else { Ack::Nack }
    }
}

pub(crate) struct Line<'a, S> {
    device: &'a mut Device<S>,
    faults: &'a mut Faults,
    address: Address,
    plan: Plan,
    bytes: u16,
    written: u16,
    /// Whether the sensor took a lost clock pulse for the end.
    cut: bool,
    /// Faults that struck and were reported.
    told: FaultSet,
    /// Faults that struck since.
    struck: FaultSet,
}

impl<'a, S: FrameSource> Line<'a, S> {
    pub(crate) fn new(
        device: &'a mut Device<S>,
        faults: &'a mut Faults,
        address: Address,
        number: u64,
    ) -> Self {
        let plan = faults.plan(address, number);
        Self {
            device,
            faults,
            address,
            plan,
            bytes: 0,
            written: 0,
            cut: false,
            told: FaultSet::EMPTY,
            struck: FaultSet::EMPTY,
        }
    }

    pub(crate) fn struck(&self) -> FaultSet {
        let mut all = self.told;
        all.join(self.struck);
        all
    }

    fn byte_on_its_way(&mut self, byte: &mut u8, register: Option<u8>) {
        let place = self.bytes;
        self.bytes = self.bytes.saturating_add(1);
        self.faults.pass_byte();
        if self.plan.flips && self.faults.flip(byte, self.address, register, place) {
            self.struck.insert(FaultKind::BitFlip);
        }
    }

    fn lost_pulse(&self) -> Option<u8> {
        let (byte, bit) = self.plan.short_clock?;
        (byte == self.bytes).then_some(bit)
    }

    fn broken_read(&mut self, now: Duration) -> u8 {
        let register = self.device.next_register();
        let lost = self.lost_pulse();
        let mut byte = if self.cut {
            0xFF
        } else {
            self.device.read(now)
        };
        if self.device.take_tore() {
            self.struck.insert(FaultKind::Torn);
        }
        if let Some(bit) = lost.filter(|_| !self.cut) {
            let late = (1_u8 << bit) - 1;
            byte = (byte & !late) | (byte >> 1 & late);
            self.cut = true;
            self.struck.insert(FaultKind::ShortClock);
        }
        self.byte_on_its_way(&mut byte, register);
        if self.plan.stuck_high {
            byte = 0xFF;
            self.struck.insert(FaultKind::StuckHigh);
        }
        if self.plan.all_zero {
            byte = 0x00;
            self.struck.insert(FaultKind::AllZero);
        }
        byte
    }

    fn broken_write(&mut self, mut byte: u8, now: Duration) -> Ack {
        let refused = if self.plan.nack_byte == Some(self.written) {
            Some(FaultKind::NackByte)
        } else {
            self.lost_pulse().map(|_| FaultKind::ShortClock)
        };
        if let Some(kind) = refused {
            self.struck.insert(kind);
            return self.device.nack();
        }
        let register = self.device.next_register();
        self.byte_on_its_way(&mut byte, register);
        self.written = self.written.saturating_add(1);
        self.device.write(byte, now)
    }

    fn start(&mut self, reads: bool, now: Duration) -> Ack {
        self.cut = false;
        if let Some(silent) = self.plan.silent {
            self.struck.insert(silent);
            return self.device.refuse_address();
        }
        let ack = if reads {
            self.device.start_read(now)
        } else {
            self.device.start_write(now)
        };
        if self.plan.torn.is_some() {
            self.device.set_tear(self.plan.torn);
        }
        ack
    }

    fn write(&mut self, byte: u8, now: Duration) -> Ack {
        if self.plan.any {
            self.broken_write(byte, now)
        } else {
            self.device.write(byte, now)
        }
    }

    fn read(&mut self, now: Duration) -> u8 {
        if self.plan.any {
            self.broken_read(now)
        } else {
            self.device.read(now)
        }
    }

    fn take_struck(&mut self) -> FaultSet {
        let mut faults = core::mem::take(&mut self.struck);
        self.told.join(faults);
        faults.join(self.plan.lasting);
        faults.join(self.device.spoiled());
        faults
    }
}
