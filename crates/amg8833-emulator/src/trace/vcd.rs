//! A bus trace as a value change dump (VCD), for waveform viewers.

use crate::signal::{Acknowledge, BusError};
use crate::trace::file::{TRACE_BYTES_MAX, TraceFile};
use crate::trace::log::{Start, Transfer};
use alloc::format;
use alloc::string::String;
use core::fmt::Write as _;
use core::num::NonZeroU32;
use core::time::Duration;
use std::io::Write;

const TICK_NS: u64 = 100;
/// The SCL frequency drawn for a bus with instant transactions.
const NOMINAL_HZ: u32 = 100_000;
/// An address and its direction, or a byte, without the acknowledge.
const BYTE_BITS: u32 = 8;

/// SCL and SDA of one bus as a value change dump (IEEE 1364, clause 18), for PulseView, sigrok-cli and GTKWave.
///
/// ```text
/// sigrok-cli -I vcd -i bus.vcd -P i2c:scl=SCL:sda=SDA
/// pulseview -I vcd bus.vcd        # then add the decoder I²C
/// ```
///
/// - Steps of 100 ns. A third line, `FAULT`, is high during messages in which a fault struck.
/// - A bus without an SCL frequency is drawn at 100 kHz, its instant transactions one after another.
/// - A hung bus has SCL low until the controller gives up. A missing adapter draws nothing.
/// - sigrok keeps every step in memory: for traces of minutes, let it skip idle time (`-I vcd:compress=1000`).
pub type VcdTrace<W> = TraceFile<W, Drawing>;

impl<W: Write> VcdTrace<W> {
    /// A trace of at most [`TRACE_BYTES_MAX`] bytes.
    pub fn new(out: W) -> Self {
        Self::with_bytes_max(out, TRACE_BYTES_MAX)
    }

    /// A trace of at most this many bytes.
    pub fn with_bytes_max(out: W, bytes_max: u64) -> Self {
        let header = format!(
            "$comment SCL and SDA of an emulated I2C bus $end\n\
             $timescale {TICK_NS} ns $end\n\
             $scope module bus $end\n\
             $var wire 1 c SCL $end\n\
             $var wire 1 d SDA $end\n\
             $var wire 1 f FAULT $end\n\
             $upscope $end\n\
             $enddefinitions $end\n\
             #0\n$dumpvars\n1c\n1d\n0f\n$end\n"
        );
        Self::begin(out, &header, bytes_max, Drawing::new())
    }

    /// The observer for [`Bus::set_trace`](crate::Bus::set_trace): for one bus only, since one pair of lines cannot
    /// show two.
    pub fn observer(&self) -> impl FnMut(&Transfer<'_>) + use<W> {
        let file = self.clone();
        move |transfer| file.message(|drawing, out| drawing.message(out, transfer))
    }
}

/// The current levels of a [`VcdTrace`]'s lines, and the time drawn so far.
#[derive(Debug)]
pub struct Drawing {
    levels: [bool; 3],
    /// Drawn up to this time, in nanoseconds.
    drawn_ns: u64,
    tick: u64,
    quarter_ns: u64,
}

const NAMES: [char; 3] = ['c', 'd', 'f'];
const SCL: usize = 0;
const SDA: usize = 1;
const FAULT: usize = 2;

impl Drawing {
    const fn new() -> Self {
        Self {
            levels: [true, true, false],
            drawn_ns: 0,
            tick: 0,
            quarter_ns: 0,
        }
    }

    fn message(&mut self, out: &mut String, transfer: &Transfer<'_>) {
        if transfer.start == Start::Never {
            return;
        }
        let hz = u64::from(transfer.scl_hz.map_or(NOMINAL_HZ, NonZeroU32::get));
        self.quarter_ns = (250_000_000 / hz).max(TICK_NS);
        self.drawn_ns = self.drawn_ns.max(nanoseconds(transfer.started));
        self.draw(out, FAULT, !transfer.faults.is_empty());
        self.start(out);
        if transfer.error == Some(BusError::Timeout) {
            self.drawn_ns = self.drawn_ns.max(nanoseconds(transfer.ended));
            self.stop(out);
            self.draw(out, FAULT, false);
            return;
        }
        let address = transfer.address << 1 | u8::from(transfer.reads);
        self.byte(
            out,
            address,
            transfer.acknowledge != Acknowledge::NotAddress,
        );
        let last = transfer.bytes.len();
        for (number, byte) in (1..).zip(transfer.bytes) {
            let refused = transfer.reads || transfer.acknowledge == Acknowledge::NotLastByte;
            self.byte(out, *byte, number < last || !refused);
        }
        if transfer.stop || transfer.error.is_some() {
            self.stop(out);
            self.draw(out, FAULT, false);
            // The lines rest between a STOP and the next START (AMG88 spec §4-6-2, tBUF).
            self.pass(4);
        }
    }

    /// Four changes of a line, each after a quarter of a bit.
    fn quarters(&mut self, out: &mut String, changes: [(usize, bool); 4]) {
        for (line, high) in changes {
            self.pass(1);
            self.draw(out, line, high);
        }
    }

    fn start(&mut self, out: &mut String) {
        self.quarters(out, [(SDA, true), (SCL, true), (SDA, false), (SCL, false)]);
    }

    fn stop(&mut self, out: &mut String) {
        self.quarters(out, [(SDA, false), (SCL, true), (SDA, true), (SDA, true)]);
    }

    fn byte(&mut self, out: &mut String, byte: u8, acknowledged: bool) {
        for place in (0..BYTE_BITS).rev() {
            self.bit(out, byte >> place & 1 != 0);
        }
        self.bit(out, !acknowledged);
    }

    fn bit(&mut self, out: &mut String, high: bool) {
        self.pass(1);
        self.draw(out, SDA, high);
        self.pass(1);
        self.draw(out, SCL, true);
        self.pass(2);
        self.draw(out, SCL, false);
    }

    fn pass(&mut self, quarters: u64) {
        let passed = self.quarter_ns.saturating_mul(quarters);
        self.drawn_ns = self.drawn_ns.saturating_add(passed);
    }

    fn draw(&mut self, out: &mut String, line: usize, high: bool) {
        if core::mem::replace(&mut self.levels[line], high) == high {
            return;
        }
        let tick = self.drawn_ns / TICK_NS;
        // Writing to a string cannot fail.
        if tick > self.tick {
            let _ = writeln!(out, "#{tick}");
            self.tick = tick;
        }
        let _ = writeln!(out, "{}{}", u8::from(high), NAMES[line]);
    }
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}
