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

/// A sensor's part in one transaction.
pub(crate) struct Line<'a, S> {
    pub(crate) device: &'a mut Device<S>,
    pub(crate) faults: &'a mut Faults,
    pub(crate) course: Course,
}

/// How far one transaction with a sensor has come.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Course {
    pub(crate) address: Address,
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
        let course = Course {
            address,
            plan: faults.plan(address, number),
            bytes: 0,
            written: 0,
            cut: false,
            told: FaultSet::EMPTY,
            struck: FaultSet::EMPTY,
        };
        Self {
            device,
            faults,
            course,
        }
    }

    pub(crate) fn struck(&self) -> FaultSet {
        let mut all = self.course.told;
        all.join(self.course.struck);
        all
    }

    fn byte_on_its_way(&mut self, byte: &mut u8, register: Option<u8>) {
        let place = self.course.bytes;
        self.course.bytes = self.course.bytes.saturating_add(1);
        self.faults.pass_byte();
        if self.course.plan.flips && self.faults.flip(byte, self.course.address, register, place) {
            self.course.struck.insert(FaultKind::BitFlip);
        }
    }

    fn lost_pulse(&self) -> Option<u8> {
        let (byte, bit) = self.course.plan.short_clock?;
        (byte == self.course.bytes).then_some(bit)
    }

    fn broken_read(&mut self, now: Duration) -> u8 {
        let register = self.device.next_register();
        let lost = self.lost_pulse();
        let mut byte = if self.course.cut {
            0xFF
        } else {
            self.device.read(now)
        };
        if self.device.take_tore() {
            self.course.struck.insert(FaultKind::Torn);
        }
        if let Some(bit) = lost.filter(|_| !self.course.cut) {
            let late = (1_u8 << bit) - 1;
            byte = (byte & !late) | (byte >> 1 & late);
            self.course.cut = true;
            self.course.struck.insert(FaultKind::ShortClock);
        }
        self.byte_on_its_way(&mut byte, register);
        if self.course.plan.stuck_high {
            byte = 0xFF;
            self.course.struck.insert(FaultKind::StuckHigh);
        }
        if self.course.plan.all_zero {
            byte = 0x00;
            self.course.struck.insert(FaultKind::AllZero);
        }
        byte
    }

    fn broken_write(&mut self, mut byte: u8, now: Duration) -> Ack {
        let refused = if self.course.plan.nack_byte == Some(self.course.written) {
            Some(FaultKind::NackByte)
        } else {
            self.lost_pulse().map(|_| FaultKind::ShortClock)
        };
        if let Some(kind) = refused {
            self.course.struck.insert(kind);
            return self.device.nack();
        }
        let register = self.device.next_register();
        self.byte_on_its_way(&mut byte, register);
        self.course.written = self.course.written.saturating_add(1);
        self.device.write(byte, now)
    }

    fn start(&mut self, reads: bool, now: Duration) -> Ack {
        self.course.cut = false;
        if let Some(silent) = self.course.plan.silent {
            self.course.struck.insert(silent);
            return self.device.refuse_address();
        }
        let ack = if reads {
            self.device.start_read(now)
        } else {
            self.device.start_write(now)
        };
        if self.course.plan.torn.is_some() {
            self.device.set_tear(self.course.plan.torn);
        }
        ack
    }

    fn write(&mut self, byte: u8, now: Duration) -> Ack {
        if self.course.plan.any {
            self.broken_write(byte, now)
        } else {
            self.device.write(byte, now)
        }
    }

    fn read(&mut self, now: Duration) -> u8 {
        if self.course.plan.any {
            self.broken_read(now)
        } else {
            self.device.read(now)
        }
    }

    fn take_struck(&mut self) -> FaultSet {
        let mut faults = core::mem::take(&mut self.course.struck);
        self.course.told.join(faults);
        faults.join(self.course.plan.lasting);
        faults.join(self.device.spoiled());
        faults
    }
}
