//! Test buses: one that records, some that fail, and one that is not ready at once.

use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};
use std::cell::RefCell;
use std::fmt;
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

/// A bus and clock that record every call; every read returns zeros.
#[derive(Clone, Default)]
pub(crate) struct Tape {
    pub(crate) events: Rc<RefCell<Vec<Event>>>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Event {
    Write(Vec<u8>),
    WriteRead(Vec<u8>, usize),
    WaitNs(u64),
}

impl Event {
    pub(crate) fn value(&self) -> u8 {
        match self {
            Self::Write(bytes) => bytes[1],
            Self::WriteRead(..) | Self::WaitNs(_) => panic!("not a write: {self:?}"),
        }
    }
}

impl Tape {
    pub(crate) fn transactions(&self) -> usize {
        self.events.borrow().len()
    }

    /// Bytes on the wire with address bytes: one before the bytes written, one more before the bytes read.
    pub(crate) fn wire_bytes(&self) -> usize {
        self.events
            .borrow()
            .iter()
            .map(|event| match event {
                Event::Write(bytes) => 1 + bytes.len(),
                Event::WriteRead(bytes, count) => 1 + bytes.len() + 1 + count,
                Event::WaitNs(_) => 0,
            })
            .sum()
    }

    /// Nine bits per byte with its acknowledge, and one each for START, repeated START and STOP.
    pub(crate) fn wire_bits(&self) -> usize {
        let conditions: usize = self
            .events
            .borrow()
            .iter()
            .map(|event| match event {
                Event::Write(_) => 2,
                Event::WriteRead(..) => 3,
                Event::WaitNs(_) => 0,
            })
            .sum();
        9 * self.wire_bytes() + conditions
    }
}

pub(crate) fn waits(events: &[Event]) -> usize {
    events
        .iter()
        .filter(|event| matches!(event, Event::WaitNs(_)))
        .count()
}

impl ErrorType for Tape {
    type Error = ErrorKind;
}

impl I2c for Tape {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), Self::Error> {
        let event = match operations {
            [Operation::Write(bytes)] => Event::Write(bytes.to_vec()),
            [Operation::Write(bytes), Operation::Read(buffer)] => {
                buffer.fill(0);
                Event::WriteRead(bytes.to_vec(), buffer.len())
            }
            other => panic!("neither a write nor a write and a read: {other:?}"),
        };
        self.events.borrow_mut().push(event);
        Ok(())
    }
}

impl embedded_hal::delay::DelayNs for Tape {
    fn delay_ns(&mut self, ns: u32) {
        self.events.borrow_mut().push(Event::WaitNs(u64::from(ns)));
    }

    fn delay_ms(&mut self, ms: u32) {
        self.events
            .borrow_mut()
            .push(Event::WaitNs(u64::from(ms) * 1_000_000));
    }
}

impl embedded_hal_async::delay::DelayNs for Tape {
    async fn delay_ns(&mut self, ns: u32) {
        embedded_hal::delay::DelayNs::delay_ns(self, ns);
    }

    async fn delay_ms(&mut self, ms: u32) {
        embedded_hal::delay::DelayNs::delay_ms(self, ms);
    }
}

/// A bus that reports success for every read but delivers only its first bytes.
pub(crate) struct Delivering {
    bytes: Vec<u8>,
    /// Reads that deliver nothing, before those that do.
    pub(crate) silent_reads: usize,
    pub(crate) reads: usize,
}

impl Delivering {
    pub(crate) fn nothing() -> Self {
        Self::only(Vec::new())
    }

    pub(crate) fn only(bytes: Vec<u8>) -> Self {
        Self {
            bytes,
            silent_reads: 0,
            reads: 0,
        }
    }
}

impl ErrorType for Delivering {
    type Error = ErrorKind;
}

impl I2c for Delivering {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), Self::Error> {
        for operation in operations {
            if let Operation::Read(buffer) = operation {
                self.reads += 1;
                if self.reads > self.silent_reads {
                    let count = self.bytes.len().min(buffer.len());
                    buffer[..count].copy_from_slice(&self.bytes[..count]);
                }
            }
        }
        Ok(())
    }
}

/// A bus on which every transfer fails, as on a Raspberry Pi without the sensor.
pub(crate) struct Broken;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RemoteIo {
    pub(crate) errno: i32,
}

impl fmt::Display for RemoteIo {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "remote i/o error {}", self.errno)
    }
}

impl std::error::Error for RemoteIo {}

impl embedded_hal::i2c::Error for RemoteIo {
    fn kind(&self) -> ErrorKind {
        ErrorKind::NoAcknowledge(NoAcknowledgeSource::Unknown)
    }
}

impl ErrorType for Broken {
    type Error = RemoteIo;
}

impl I2c for Broken {
    fn transaction(&mut self, _: u8, _: &mut [Operation<'_>]) -> Result<(), Self::Error> {
        Err(RemoteIo { errno: 121 })
    }
}

/// An async wrapper of a blocking bus that is not ready on the first poll, like a real one.
pub(crate) struct Yielding<B> {
    pub(crate) bus: B,
}

impl<B> Yielding<B> {
    pub(crate) fn new(bus: B) -> Self {
        Self { bus }
    }
}

impl<B: ErrorType> ErrorType for Yielding<B> {
    type Error = B::Error;
}

impl<B: I2c> embedded_hal_async::i2c::I2c for Yielding<B> {
    async fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), Self::Error> {
        yield_once().await;
        self.bus.write(address, bytes)
    }

    async fn write_read(
        &mut self,
        address: u8,
        bytes: &[u8],
        buffer: &mut [u8],
    ) -> Result<(), Self::Error> {
        yield_once().await;
        self.bus.write_read(address, bytes, buffer)
    }

    async fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), Self::Error> {
        yield_once().await;
        self.bus.transaction(address, operations)
    }
}

async fn yield_once() {
    let mut yielded = false;
    std::future::poll_fn(|_| {
        if yielded {
            Poll::Ready(())
        } else {
            yielded = true;
            Poll::Pending
        }
    })
    .await;
}

/// Polls a future to its end, within 100 polls: futures of this crate need one per transaction.
pub(crate) fn block_on<F: Future>(future: F) -> F::Output {
    const POLLS_MAX: usize = 100;
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    for _ in 0..POLLS_MAX {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return output;
        }
    }
    panic!("still not ready after {POLLS_MAX} polls")
}
